"""COLMAP's Python module, without what importing it does to the process.

Its logging library takes SIGTERM for a crash and prints a stack trace; here the handler that was
there before is put back. Everyone imports `pycolmap` from this module.
"""

from __future__ import annotations

import signal
import threading

import pycolmap

__all__ = ["pycolmap"]

if threading.current_thread() is threading.main_thread():  # Python sets handlers there alone
    signal.signal(signal.SIGTERM, signal.getsignal(signal.SIGTERM))
