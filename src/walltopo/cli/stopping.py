"""Ctrl-C and SIGTERM end a command at once, whatever a library makes of them.

Python raises KeyboardInterrupt between two bytecodes of the main thread: after a long native call
only, and in vain where a library catches every exception while it is imported. So a thread hears
of the signal too, and ends the process when that has not happened in two seconds. Nothing is lost
by it: files are renamed into place when they are whole, and the next run sweeps the rest.
(Native code that holds the interpreter's lock delays the thread too, by some seconds: compiled
kernels of ours do.)
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

STOPPED = "stopped; run the same command again to go on"

_GRACE_S = 2.0
_SHOW_CURSOR = "\x1b[?25h"  # the progress bar hides it
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stop:
    """Whether a signal asked the command to end; `number` is 0 as long as none did."""

    number = 0

    @property
    def exit_code(self) -> int:
        """As shells tell a death by signal: 130 for Ctrl-C, 143 for SIGTERM."""
        return 128 + (self.number or signal.SIGINT)


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Hear of signals in the block; in a thread of a larger program nothing is touched."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        for other in _SIGNALS:  # a second one shall not disturb the clearing up; the thread ends it
            signal.signal(other, lambda *_: None)
        stop.number = number
        raise KeyboardInterrupt

    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    before = {number: signal.signal(number, interrupt) for number in _SIGNALS}
    # Written by the interpreter's C handler at the moment of the signal, whatever Python does.
    woken = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    watch = threading.Thread(target=_watch, args=(reader, stop), daemon=True)
    watch.start()
    try:
        yield stop
    finally:
        signal.set_wakeup_fd(woken)
        for number, handler in before.items():
            signal.signal(number, handler)
        os.close(writer)  # ends the thread, if nothing woke it


def _watch(reader: int, stop: Stop) -> None:
    while True:
        told = os.read(reader, 1)
        if not told:
            os.close(reader)
            return
        if told[0] in _SIGNALS:
            break
    stop.number = stop.number or told[0]
    time.sleep(_GRACE_S)
    cursor = _SHOW_CURSOR if sys.stderr.isatty() else ""
    os.write(2, f"{cursor}\n{STOPPED}\n".encode())
    os._exit(stop.exit_code)
