"""The film of docs/grades.md: how a route may go for one climber and for another, side by side.

    python -m tools.pages.moves_film LEFT RIGHT docs/pictures/moves.webp

LEFT and RIGHT are folders of pictures that `viewer/tests/moves.mjs` took (`make film` does both).
The first climber to reach the top waits there for the other.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np
from PIL import Image

from tools.pages.film import write_film
from walltopo.images.files import read_rgb

RATE = 5  # frames per second, the rate at which moves.mjs captures the climb


def beside(left: Path, right: Path) -> list[Image.Image]:
    """Return the frames of two folders, sorted by name, pairwise side by side."""
    sides = [[read_rgb(file) for file in sorted(folder.glob("*.png"))] for folder in (left, right)]
    pairs = zip_longest(*sides)
    last = [side[-1] for side in sides]
    return [
        Image.fromarray(np.hstack([last[k] if one is None else one for k, one in enumerate(pair)]))
        for pair in pairs
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("left", type=Path)
    parser.add_argument("right", type=Path)
    parser.add_argument("out", type=Path)
    args = parser.parse_args(arguments)
    size = write_film(beside(args.left, args.right), args.out, RATE)
    sys.stdout.write(f"{args.out}: {size / 1e6:.2f} MB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
