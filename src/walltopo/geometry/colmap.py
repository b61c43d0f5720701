"""Import `pycolmap` without its side effects on the process.

COLMAP's logging library handles SIGTERM as a crash and prints a stack trace. This module restores
the previous handler; all other modules import `pycolmap` from here.
"""

from __future__ import annotations

import ctypes
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_SIGACTION_BYTES = 1024  # more than any system's `struct sigaction`


@contextmanager
def _restore_handler(number: signal.Signals) -> Iterator[None]:
    """Restore the system's signal handler after the block.

    `signal.signal` works in the main thread only, and a server imports this module in another one.
    """
    if sys.platform == "win32":
        yield
        return
    system, before = ctypes.CDLL(None), ctypes.create_string_buffer(_SIGACTION_BYTES)
    system.sigaction(int(number), None, before)
    try:
        yield
    finally:
        system.sigaction(int(number), before, None)


with _restore_handler(signal.SIGTERM):
    import pycolmap

__all__ = ["pycolmap"]
