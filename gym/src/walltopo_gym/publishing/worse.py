"""Where a new scan looks worse than the one it would replace: for a setter to look at twice."""

from __future__ import annotations

from typing import Final

from walltopo.scans.manifest import Manifest

# Below this share of what it was before, it is said. A reset changes holds, not the wall.
_LEAST_AREA: Final = 0.8
_LEAST_HOLDS: Final = 0.6
_LEAST_PLACED: Final = 0.8


def worse_than(before: Manifest | None, after: Manifest) -> list[str]:
    """What is worse, in words; empty where nothing is.

    Parameters
    ----------
    before : of the published version, None for the first one.
    """
    warnings = []
    photos, placed = _figure(after, "sparse", "photos"), _figure(after, "sparse", "registered")
    if placed < _LEAST_PLACED * photos:
        warnings.append(
            f"Only {placed:.0f} of {photos:.0f} photos could be placed: parts may be missing."
        )
    if before is None:
        return warnings
    areas = [_figure(scan, "dense", "area") for scan in (before, after)]
    if areas[1] < _LEAST_AREA * areas[0]:
        warnings.append(
            f"The wall has {areas[1]:.0f} m², the published version {areas[0]:.0f} m²: "
            "routes beyond its edge would count as stripped."
        )
    holds = [_figure(scan, "classify", "holds") for scan in (before, after)]
    if holds[1] < _LEAST_HOLDS * holds[0]:
        warnings.append(
            f"{holds[1]:.0f} holds were found, {holds[0]:.0f} in the published version."
        )
    return warnings


def _figure(scan: Manifest, stage: str, name: str) -> float:
    record = scan.stages.get(stage)
    return float(record.metrics.get(name, 0.0)) if record is not None else 0.0
