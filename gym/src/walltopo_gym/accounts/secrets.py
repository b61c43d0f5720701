"""Secrets that a server gives out: 256 random bits, of which only the hash is kept.

A plain SHA-256 is enough: nothing that long is guessed (OWASP, session management).
"""

from __future__ import annotations

import hashlib
import secrets


def new_secret(prefix: str = "") -> tuple[str, str]:
    """A new secret and its hash."""
    text = prefix + secrets.token_urlsafe(32)
    return text, hash_of(text)


def hash_of(text: str) -> str:
    """What is kept of a secret."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
