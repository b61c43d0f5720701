"""Decoders written in C say nothing on the terminal."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image


def test_a_scratched_jpeg_is_read_in_silence(tmp_path: Path) -> None:
    path = tmp_path / "scratched.jpg"
    noise = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
    Image.fromarray(noise).save(path)
    data = bytearray(path.read_bytes())
    data[3000:3100] = bytes(100)
    path.write_bytes(data)
    assert _output_of(READ, str(path)) == ("(120, 160, 3)\n", "")


def test_the_terminal_comes_back() -> None:
    assert _output_of(DECODE) == ("", "after\n")


READ = """
from pathlib import Path

from walltopo.images.files import read_rgb

print(read_rgb(Path(sys.argv[1])).shape)
"""

DECODE = """
import os
from concurrent.futures import ThreadPoolExecutor

from walltopo.images.files import silence_stderr

def decode(number):
    with silence_stderr():
        os.write(2, b"noise\\n")

with ThreadPoolExecutor(8) as pool:
    list(pool.map(decode, range(400)))
os.write(2, b"after\\n")
"""


def _output_of(code: str, *words: str) -> tuple[str, str]:
    """Return what a process of its own writes: here other tests' threads may write, too."""
    command = [sys.executable, "-c", "import sys\n" + code, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600)
    return done.stdout, done.stderr
