"""A child process that does not outlive its parent."""

from __future__ import annotations

import os
import threading

__all__ = ["end_with_parent"]


def end_with_parent() -> None:
    """Let this process end when its stdin does, which its parent holds: nobody would read on.

    What the parent has to say must have been read before.
    """
    threading.Thread(target=_wait, daemon=True).start()


def _wait() -> None:
    # Of the file itself: a thread that waits in a buffered reader has its lock when Python ends.
    while os.read(0, 4096):
        pass
    os._exit(1)
