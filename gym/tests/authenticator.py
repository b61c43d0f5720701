"""A passkey's device, as far as a server can tell: makes a key, and signs with it.

Web Authentication, level 3: 6.1 authenticator data, 6.5.4 attestation object, 7.2 assertion.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from base64 import urlsafe_b64encode
from typing import Any

import cbor2
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256

_PRESENT, _VERIFIED, _WITH_KEY = 0x01, 0x04, 0x40


def text(content: bytes) -> str:
    """Base64url without padding, as browsers give it."""
    return urlsafe_b64encode(content).rstrip(b"=").decode()


class Device:
    """One device with one key.

    Parameters
    ----------
    verifies : whether it asks its owner for a PIN or a finger.
    """

    def __init__(self, origin: str, verifies: bool = True) -> None:
        self.id = secrets.token_bytes(32)
        self.origin, self._count = origin, 0
        self._flags = _PRESENT | (_VERIFIED if verifies else 0)
        self._key = ec.generate_private_key(ec.SECP256R1())

    def public_key(self) -> bytes:
        """Return the public key in COSE."""
        point = self._key.public_key().public_numbers()
        x, y = point.x.to_bytes(32, "big"), point.y.to_bytes(32, "big")
        coded: bytes = cbor2.dumps({1: 2, 3: -7, -1: 1, -2: x, -3: y})
        return coded

    def make(self, options: dict[str, Any]) -> dict[str, Any]:
        """The answer to `navigator.credentials.create`."""
        held = len(self.id).to_bytes(2, "big") + self.id + self.public_key()
        data = self._data(options["rp"]["id"], _WITH_KEY) + bytes(16) + held
        attestation = cbor2.dumps({"fmt": "none", "attStmt": {}, "authData": data})
        client = self._client("webauthn.create", options["challenge"])
        return self._answer(clientDataJSON=client, attestationObject=attestation)

    def sign(self, options: dict[str, Any]) -> dict[str, Any]:
        """The answer to `navigator.credentials.get`."""
        self._count += 1
        data = self._data(options["rpId"])
        client = self._client("webauthn.get", options["challenge"])
        signed = self._key.sign(data + hashlib.sha256(client).digest(), ec.ECDSA(SHA256()))
        return self._answer(clientDataJSON=client, authenticatorData=data, signature=signed)

    def _data(self, host: str, flags: int = 0) -> bytes:
        answer = bytes([self._flags | flags]) + self._count.to_bytes(4, "big")
        return hashlib.sha256(host.encode()).digest() + answer

    def _client(self, kind: str, challenge: str) -> bytes:
        answer = {"type": kind, "challenge": challenge, "origin": self.origin}
        return json.dumps(answer).encode()

    def _answer(self, **response: bytes) -> dict[str, Any]:
        return {
            "id": text(self.id),
            "rawId": text(self.id),
            "type": "public-key",
            "response": {name: text(content) for name, content in response.items()},
        }
