"""How many threads OpenCV takes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["opencv_in_one_thread"]


@contextmanager
def opencv_in_one_thread() -> Iterator[None]:
    """While this is open, OpenCV works in the thread that calls it alone, in the whole process."""
    import cv2

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
