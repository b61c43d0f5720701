"""Passwords that stood in leaks: of the commonest million those that are long enough to be chosen.

Kept are the first bytes of a hash of each, sorted, so that nobody's password can be read here;
`README.md` beside this file says where they are from. Nobody is asked: no password leaves the
server.
"""

from __future__ import annotations

import hashlib
from bisect import bisect_left
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import Final

__all__ = ["is_leaked", "marks_of"]

# Of one in ten million that never leaked it is said, too.
_BYTES: Final = 5


def is_leaked(password: str) -> bool:
    """Whether it is one of them, written in small or capital letters."""
    marks, wanted = _marks(), _mark(password)
    at = bisect_left(range(len(marks) // _BYTES), wanted, key=lambda place: _at(marks, place))
    return _at(marks, at) == wanted


def marks_of(passwords: Iterable[str], shortest: int) -> bytes:
    """What is kept of a list of passwords.

    Parameters
    ----------
    shortest : characters; whatever has fewer cannot be chosen, and is left out.
    """
    return b"".join(sorted({_mark(each) for each in passwords if len(each) >= shortest}))


def _mark(password: str) -> bytes:
    return hashlib.sha256(password.casefold().encode()).digest()[:_BYTES]


def _at(marks: bytes, place: int) -> bytes:
    return marks[place * _BYTES : (place + 1) * _BYTES]


@cache
def _marks() -> bytes:
    return files(__name__).joinpath("marks.bin").read_bytes()
