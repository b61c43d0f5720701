"""A spray wall by formula."""

from __future__ import annotations

import numpy as np

from walltopo.scans.holds import Hold

TYPES = ("jug", "crimp", "sloper", "pinch", "pocket", "foothold")


def spray_wall(
    count: int = 60, steepness_deg: float = 20.0, seed: int = 0, unit: float = 1.0
) -> tuple[Hold, ...]:
    """Holds of all types strewn over a wall of 3 m by 3.4 m; `unit`: of the scan, a metre."""
    random = np.random.default_rng(seed)
    lean = np.radians(steepness_deg)
    rows = []
    for k in range(count):
        along, across = random.uniform(0.2, 3.4), random.uniform(-1.5, 1.5)
        kind = TYPES[int(random.integers(len(TYPES)))]
        x, y, z = across, -along * float(np.sin(lean)), along * float(np.cos(lean))
        size = 0.05 if kind == "foothold" else float(random.uniform(0.07, 0.2))
        rows.append(
            Hold(
                id=k + 1,
                kind="hold",
                type=kind,
                colour="red",
                colour_rgb=(200, 0, 0),
                position=(x * unit, y * unit, z * unit),
                normal=(0.0, -float(np.cos(lean)), -float(np.sin(lean))),
                size=size * unit,
                area=0.01,
                steepness_deg=steepness_deg,
                photos=(),
                score=1.0,
                route=None,
            )
        )
    return tuple(rows)
