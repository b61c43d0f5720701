"""What C libraries write to the terminal while they decode a picture, kept from it."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["hushed"]

_STDERR = 2
_lock = threading.Lock()
_inside = 0  # threads that decode at this moment
_saved = -1  # the terminal's descriptor meanwhile


@contextmanager
def hushed() -> Iterator[None]:
    """Send descriptor 2 nowhere in the block: libjpeg, libpng and libtiff write there directly.

    Whether a picture could be read is told by the decoder's result. Any number of threads may be
    inside at once; the last one out gives the terminal back.
    """
    _enter()
    try:
        yield
    finally:
        _leave()


def _enter() -> None:
    global _inside, _saved
    with _lock:
        _inside += 1
        if _inside > 1:
            return
        try:
            _saved = os.dup(_STDERR)
        except OSError:  # closed: nobody would see it anyway
            return
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, _STDERR)
        os.close(nowhere)


def _leave() -> None:
    global _inside, _saved
    with _lock:
        _inside -= 1
        if _inside == 0 and _saved >= 0:
            os.dup2(_saved, _STDERR)
            os.close(_saved)
            _saved = -1
