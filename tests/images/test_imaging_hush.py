"""Decoders written in C say nothing on the terminal."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from walltopo.images.files import read_rgb, silence_stderr


def test_a_scratched_jpeg_is_read_in_silence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "scratched.jpg"
    noise = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
    Image.fromarray(noise).save(path)
    data = bytearray(path.read_bytes())
    data[3000:3100] = bytes(100)
    path.write_bytes(data)
    assert read_rgb(path).shape == (120, 160, 3)
    assert capfd.readouterr().err == ""


def test_the_terminal_comes_back(capfd: pytest.CaptureFixture[str]) -> None:
    def decode(number: int) -> None:
        with silence_stderr():
            os.write(2, b"noise\n")

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(decode, range(400)))
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "after\n"
