"""Sign records with a person's Ed25519 key (RFC 8032), and check such signatures.

The server makes the key when its person first finishes an inspection, and keeps it in the database
like its other secrets.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
from dataclasses import dataclass
from typing import Any, Final
from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.database.engine import take_turn
from walltopo_gym.inspections.models import InspectionKey

# Crockford's base 32: no I, L, O and U.
_LETTERS: Final = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
_ALIKE: Final = str.maketrans("ILO", "110", "- ")
CODE_LENGTH: Final = 16  # 80 bits


@dataclass(frozen=True)
class Signature:
    """A signature and the public key that checks it, both base64."""

    public_key: str
    signature: str


def canonical_text(record: dict[str, Any]) -> str:
    """Return the one text of a record that is signed: JSON without spaces, its keys sorted.

    Records have texts, whole numbers, lists and null alone, so this is their form by RFC 8785.
    """
    return json.dumps(record, ensure_ascii=False, sort_keys=True, separators=(",", ":"))


def sign_text(session: Session, person: UUID, text: str) -> Signature:
    """Sign a text with a person's key, which is made when it is first needed."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    if session.get(InspectionKey, person) is None:
        take_turn(session, f"inspection key {person}")
    row = session.get(InspectionKey, person)
    if row is None:
        made = Ed25519PrivateKey.generate()
        row = InspectionKey(
            person_id=person,
            secret=_encode(made.private_bytes_raw()),
            public_key=_encode(made.public_key().public_bytes_raw()),
        )
        session.add(row)
        session.flush()
    key = Ed25519PrivateKey.from_private_bytes(base64.b64decode(row.secret))
    return Signature(row.public_key, _encode(key.sign(text.encode())))


def is_signed(text: str, by: Signature) -> bool:
    """Return whether a signature is of this text."""
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    try:
        key = Ed25519PublicKey.from_public_bytes(base64.b64decode(by.public_key, validate=True))
        key.verify(base64.b64decode(by.signature, validate=True), text.encode())
    except (InvalidSignature, binascii.Error, ValueError):
        return False
    return True


def code_of(text: str) -> str:
    """Return the code of a record that people read from paper: the begin of its text's SHA-256."""
    number = int.from_bytes(hashlib.sha256(text.encode()).digest(), "big")
    first = number >> (256 - 5 * CODE_LENGTH)
    return "".join(_LETTERS[first >> 5 * place & 31] for place in reversed(range(CODE_LENGTH)))


def read_code(given: str) -> str | None:
    """Return a code in its one spelling; None if it cannot be one."""
    code = given.upper().translate(_ALIKE)
    return code if len(code) == CODE_LENGTH and set(code) <= set(_LETTERS) else None


def key_name(public_key: str) -> str:
    """Return the short name of a public key, for people: the begin of its SHA-256 in hex."""
    return hashlib.sha256(public_key.encode()).hexdigest()[:16]


def _encode(content: bytes) -> str:
    return base64.b64encode(content).decode()
