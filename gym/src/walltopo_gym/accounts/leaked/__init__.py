"""Leaked passwords: those of the commonest million that are long enough to be chosen.

The file holds the sorted first bytes of a hash of each, so that no password can be read from it;
`README.md` beside this file names the source. No password leaves the server.
"""

from __future__ import annotations

import hashlib
from bisect import bisect_left
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import Final

__all__ = ["SHORTEST", "is_leaked", "marks_of"]

SHORTEST: Final = 10  # characters of a password; shorter ones are refused, leaked or not

# One in ten million passwords that never leaked is refused, too.
_BYTES: Final = 5


def is_leaked(password: str) -> bool:
    """Return whether a password is among them, regardless of case."""
    marks, wanted = _leaked_hashes(), _hash_password(password)
    at = bisect_left(range(len(marks) // _BYTES), wanted, key=lambda index: _hash_at(marks, index))
    return _hash_at(marks, at) == wanted


def marks_of(passwords: Iterable[str], shortest: int) -> bytes:
    """Return the stored form of a list of passwords.

    Parameters
    ----------
    shortest : minimum number of characters; shorter passwords are left out.
    """
    return b"".join(sorted({_hash_password(each) for each in passwords if len(each) >= shortest}))


def _hash_password(password: str) -> bytes:
    return hashlib.sha256(password.casefold().encode()).digest()[:_BYTES]


def _hash_at(marks: bytes, index: int) -> bytes:
    return marks[index * _BYTES : (index + 1) * _BYTES]


@cache
def _leaked_hashes() -> bytes:
    return files(__name__).joinpath("marks.bin").read_bytes()
