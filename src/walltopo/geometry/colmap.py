"""COLMAP's Python module, without what importing it does to the process.

Its logging library takes SIGTERM for a crash and prints a stack trace; here the handler that was
there before is put back. Everyone imports `pycolmap` from this module.
"""

from __future__ import annotations

import ctypes
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_ROOM = 1024  # bytes, more than any system's `struct sigaction` has


@contextmanager
def _handler_kept(number: signal.Signals) -> Iterator[None]:
    """Put the system's handler back afterwards; Python itself sets handlers in its main thread
    alone, and a server imports this in another."""
    if sys.platform == "win32":
        yield
        return
    system, before = ctypes.CDLL(None), ctypes.create_string_buffer(_ROOM)
    system.sigaction(int(number), None, before)
    try:
        yield
    finally:
        system.sigaction(int(number), before, None)


with _handler_kept(signal.SIGTERM):
    import pycolmap

__all__ = ["pycolmap"]
