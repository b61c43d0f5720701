"""A speed reference for machines: the time of a fixed piece of work.

    python -m benchmarks.calibration

The work is OpenCV's SIFT on one generated picture, on one thread. To compare seconds between
machines, or with those of a busy machine, divide them by this time.
"""

from __future__ import annotations

import time

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.reconstruct.dense.sgm import opencv_in_one_thread

_WIDTH, _HEIGHT = 1600, 1200


def picture() -> NDArray[np.uint8]:
    """Return (1200, 1600) grey noise at all sizes from 2 to 128 pixels, equal on every machine."""
    rng = np.random.default_rng(0)
    total = np.zeros((_HEIGHT, _WIDTH), dtype=np.float32)
    for size in (2, 8, 32, 128):
        coarse = rng.random((_HEIGHT // size + 1, _WIDTH // size + 1), dtype=np.float32)
        total += cv2.resize(coarse, (_WIDTH, _HEIGHT), interpolation=cv2.INTER_CUBIC)
    scaled = cv2.normalize(total, np.zeros_like(total), 0, 255, cv2.NORM_MINMAX)
    return np.asarray(scaled, dtype=np.uint8)


def calibration_s(repeats: int = 5) -> float:
    """Return the best of some runs, seconds of wall clock."""
    image, sift = picture(), cv2.SIFT.create(nfeatures=8192)
    best = np.inf
    with opencv_in_one_thread():
        for _ in range(repeats):
            begun = time.perf_counter()
            sift.detectAndCompute(image, None)
            best = min(best, time.perf_counter() - begun)
    return float(best)


if __name__ == "__main__":
    print(f"calibration: {calibration_s():.3f} s")
