"""`python -m walltopo_gym.accounts.leaked LIST`: make `marks.bin` of a list, a password a line."""

from __future__ import annotations

import sys
from pathlib import Path

from walltopo_gym.accounts.leaked import marks_of
from walltopo_gym.accounts.passwords import SHORTEST

if __name__ == "__main__":
    with Path(sys.argv[1]).open(encoding="utf-8") as lines:
        marks = marks_of((line.rstrip("\r\n") for line in lines), SHORTEST)
    Path(__file__).with_name("marks.bin").write_bytes(marks)
