"""Secrets of the server: 256 random bits each, of which only the hash is stored.

Plain SHA-256 suffices, because nobody can guess so long a secret (OWASP, session management).
"""

from __future__ import annotations

import hashlib
import secrets


def new_secret(prefix: str = "") -> tuple[str, str]:
    """Return a new secret and its hash."""
    text = prefix + secrets.token_urlsafe(32)
    return text, hash_of(text)


def hash_of(text: str) -> str:
    """Return the stored hash of a secret."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
