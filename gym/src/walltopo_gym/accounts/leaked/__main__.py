"""`python -m walltopo_gym.accounts.leaked LIST`: make `marks.bin` from a file of passwords."""

from __future__ import annotations

import sys
from pathlib import Path

from walltopo_gym.accounts.leaked import SHORTEST, marks_of

if __name__ == "__main__":
    with Path(sys.argv[1]).open(encoding="utf-8") as lines:
        marks = marks_of((line.rstrip("\r\n") for line in lines), SHORTEST)
    Path(__file__).with_name("marks.bin").write_bytes(marks)
