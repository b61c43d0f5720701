"""The yardstick of machines is the same everywhere, and the report of stages tells ratios to it."""

from __future__ import annotations

import hashlib

import cv2
import pytest
from benchmarks.calibration import calibration_s, picture
from benchmarks.scan import report_stages


def test_the_picture_is_the_same_each_time_and_has_features() -> None:
    image = picture()
    digests = {hashlib.blake2b(one.tobytes()).digest() for one in (image, picture())}
    assert image.shape == (1200, 1600)
    assert len(digests) == 1
    assert len(cv2.SIFT.create(nfeatures=8192).detect(image[:300, :400], None)) > 100


def test_it_gives_the_threads_back() -> None:
    before = cv2.getNumThreads()
    assert calibration_s(repeats=1) > 0
    assert cv2.getNumThreads() == before


def test_stages_are_in_seconds_and_in_calibrations(
    capsys: pytest.CaptureFixture[str],
) -> None:
    stage = {"seconds": 30.0, "peak_mb": 1024.0}
    report_stages(
        "gym-a",
        {
            "calibrations_s": (0.5, 1.5),
            "stages": {"dense": stage},
            "seconds": 30.0,
            "peak_mb": 2048,
        },
    )
    output = capsys.readouterr().out
    assert "Stages of gym-a:" in output
    assert "| dense | 30.0 | 30 | 1.0 |" in output
    assert "| all | 30.0 | 30 | 2.0 |" in output
