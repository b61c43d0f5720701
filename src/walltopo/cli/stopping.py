"""Let Ctrl-C and SIGTERM end a command at once, whatever libraries do with the signal.

Python raises KeyboardInterrupt between two bytecodes of the main thread. This is late after a long
native call, and lost if a library catches every exception during its import. A thread therefore
watches for the signal too, and ends the process if it has not ended within two seconds. No data is
lost: finished files are renamed into place, and the next run removes the rest. (Native code that
holds the interpreter's lock, such as our compiled kernels, delays the thread too, by some seconds.)
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

STOPPED = "stopped; run the same command again to continue"

_GRACE_S = 2.0
_SHOW_CURSOR = "\x1b[?25h"  # the progress bar hides the cursor
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stop:
    """The signal that stopped the command; `number` is 0 if there was none."""

    number = 0

    @property
    def exit_code(self) -> int:
        """Return the exit code by the shells' convention: 130 for Ctrl-C, 143 for SIGTERM."""
        return 128 + (self.number or signal.SIGINT)


@contextmanager
def handle_signals() -> Iterator[Stop]:
    """Handle signals during the block; do nothing outside the main thread."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        for other in _SIGNALS:  # a second signal must not disturb the cleanup; the thread ends it
            signal.signal(other, lambda *_: None)
        stop.number = number
        raise KeyboardInterrupt

    # Sockets: Windows cannot make a pipe non-blocking.
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    before = {number: signal.signal(number, interrupt) for number in _SIGNALS}
    # The interpreter's C handler writes to this at the moment of the signal.
    woken = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    watch = threading.Thread(target=_watch, args=(reader, stop), daemon=True)
    watch.start()
    try:
        yield stop
    finally:
        signal.set_wakeup_fd(woken)
        for number, handler in before.items():
            signal.signal(number, handler)
        writer.close()  # ends the thread if no signal woke it


def _watch(reader: socket.socket, stop: Stop) -> None:
    while True:
        signals = reader.recv(1)
        if not signals:
            reader.close()
            return
        if signals[0] in _SIGNALS:
            break
    stop.number = stop.number or signals[0]
    time.sleep(_GRACE_S)
    cursor = _SHOW_CURSOR if sys.stderr.isatty() else ""
    os.write(2, f"{cursor}\n{STOPPED}\n".encode())
    os._exit(stop.exit_code)
