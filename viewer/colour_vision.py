"""Find out which hold paints look alike to whom, and give those a pattern each.

    python viewer/colour_vision.py

writes `viewer/src/data/colour_vision.json`, which the viewer and the platform's app read.

The cone types' loss is simulated by the matrices of Machado, Oliveira and Fernandes (2009, "A
physiologically-based model for simulation of color vision deficiency", severity 1), on linear RGB.
Two paints are alike when they are nearer in Oklab than the nearest two are to everybody else.
"""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import atomic_path
from walltopo.describe.classify.palette import REFERENCE
from walltopo.images.colour import linear_from_srgb, oklab_from_linear

FILE: Final = Path(__file__).parent / "src" / "data" / "colour_vision.json"
Floats = NDArray[np.float64]

_VISIONS: Final[dict[str, Floats]] = {
    "protan": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deutan": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritan": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
    "none": np.tile([0.2126, 0.7152, 0.0722], (3, 1)),  # luminance of sRGB
}


def distances(vision: Floats | None = None) -> dict[tuple[str, str], float]:
    """Return the distance in Oklab of each two paints, to usual vision or a simulated one."""
    linear = linear_from_srgb(np.array(list(REFERENCE.values())) / 255)
    seen = linear if vision is None else np.clip(linear @ vision.T, 0, 1)
    places = dict(zip(REFERENCE, oklab_from_linear(seen), strict=True))
    return {
        (one, other): float(np.linalg.norm(places[one] - places[other]))
        for one, other in combinations(REFERENCE, 2)
    }


def alike() -> dict[str, dict[str, list[str]]]:
    """Return for each vision the paints that look like others, with those others."""
    nearest = min(distances().values())
    found: dict[str, dict[str, list[str]]] = {}
    for name, vision in _VISIONS.items():
        others: dict[str, list[str]] = {}
        for (one, other), distance in distances(vision).items():
            if distance < nearest:
                others.setdefault(one, []).append(other)
                others.setdefault(other, []).append(one)
        found[name] = {paint: others[paint] for paint in REFERENCE if paint in others}
    return found


def patterns(others: dict[str, list[str]]) -> dict[str, int]:
    """Return a number for each paint, another one than those that look like it have; 0 is plain."""
    given: dict[str, int] = {}
    for paint in sorted(others, key=lambda name: -len(others[name])):
        taken = {given.get(other) for other in others[paint]}
        given[paint] = next(k for k in range(len(others) + 1) if k not in taken)
    return given


def ink(paint: str) -> str:
    """Return black or white, whichever is seen better on a paint (WCAG's contrast)."""
    red, green, blue = linear_from_srgb(np.array(REFERENCE[paint]) / 255)
    luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    return "#000" if (luminance + 0.05) ** 2 > 0.05 * 1.05 else "#fff"


def text() -> str:
    """Return the content of the file."""
    table = {
        vision: {
            paint: {"pattern": patterns(others)[paint], "ink": ink(paint), "alike": others[paint]}
            for paint in others
        }
        for vision, others in alike().items()
    }
    return json.dumps(table, indent=1) + "\n"


if __name__ == "__main__":
    with atomic_path(FILE) as temporary:
        temporary.write_text(text(), encoding="utf-8")
