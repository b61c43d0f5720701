"""The server's secrets for push messages and for the links that unsubscribe."""

from __future__ import annotations

import base64
import hashlib
import hmac
import secrets
from uuid import UUID

from walltopo_gym.database.engine import Database
from walltopo_gym.storage.server_secrets import stored_secret

_PUSH = "push"
_UNSUBSCRIBE = "unsubscribe"


def push_key(database: Database) -> str:
    """Return the private key that signs push messages (RFC 8292), as PEM."""
    return stored_secret(database, _PUSH, _new_push_key)


def public_push_key(database: Database) -> str:
    """Return its public half as browsers need it: an uncompressed point, base64url."""
    from cryptography.hazmat.primitives.serialization import (
        Encoding,
        PublicFormat,
        load_pem_private_key,
    )

    key = load_pem_private_key(push_key(database).encode(), None).public_key()
    point = key.public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)
    return base64.urlsafe_b64encode(point).decode().rstrip("=")


def unsubscribe_token(database: Database, person: UUID) -> str:
    """Return the token of a person's unsubscribe link, which needs no sign-in."""
    key = stored_secret(database, _UNSUBSCRIBE, lambda: secrets.token_urlsafe(32))
    digest = hmac.digest(key.encode(), person.bytes, hashlib.sha256)[:16]
    return base64.urlsafe_b64encode(person.bytes + digest).decode().rstrip("=")


def person_of(database: Database, token: str) -> UUID | None:
    """Return the person of an unsubscribe token; None for an invalid one."""
    try:
        content = base64.urlsafe_b64decode(token + "=" * (-len(token) % 4))
        person = UUID(bytes=content[:16])
    except ValueError:
        return None
    right = unsubscribe_token(database, person)
    return person if hmac.compare_digest(right.encode(), token.encode()) else None


def _new_push_key() -> str:
    from py_vapid import Vapid02

    key = Vapid02()
    key.generate_keys()
    pem: bytes = key.private_pem()
    return pem.decode()
