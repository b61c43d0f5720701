"""The list of labelled walls, divided into tuning and test walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walltopo.core import InputError
from walltopo.core.files import hash_path, read_toml

_PATHS = ("truth", "scan", "mesh", "cameras", "masks")


@dataclass(frozen=True)
class Wall:
    """One labelled wall.

    Parameters
    ----------
    name : name of the physical wall, the same for all its scans, also across a reset.
    use : train or test.
    truth : folder with the ground truth.
    scan : scan folder of the wall; without one the next three apply.
    mesh, cameras, masks : inputs of the lift instead of a scan's; None: the truth's mesh, its
        `cameras/` and `masks.json`.
    """

    name: str
    use: str
    truth: Path
    scan: Path | None = None
    mesh: Path | None = None
    cameras: Path | None = None
    masks: Path | None = None


def read_walls(path: Path) -> list[Wall]:
    """Read a list of walls from a TOML file; paths are relative to the file.

    The file has `[[wall]]` tables with `name`, `use` ("train" or "test"), `truth`, and `scan` or
    any of `mesh`, `cameras`, `masks`.

    Raises
    ------
    InputError : invalid file, or a wall is both a train and a test wall, which would report
        overfitted metrics.
    """
    rows = read_toml(path).get("wall", [])
    if not isinstance(rows, list) or not rows:
        raise InputError(f"{path}: no [[wall]] tables in it")
    walls = [_wall(row, Path(path)) for row in rows]
    uses: dict[str, set[str]] = {}
    for wall in walls:
        uses.setdefault(wall.name, set()).add(wall.use)
    both = sorted(name for name, use in uses.items() if len(use) > 1)
    if both:
        raise InputError(
            f"{path}: {', '.join(both)} would be tuned on and reported on",
            "Give each wall, with all scans of it, to one of train and test.",
        )
    truths = {wall.use: {w.truth for w in walls if w.use == wall.use} for wall in walls}
    shared = truths.get("train", set()) & truths.get("test", set())
    if shared:
        raise InputError(f"{path}: {sorted(shared)[0]} is the truth of train and of test walls")
    if not truths.get("train"):
        raise InputError(f'{path}: no wall to tune on (use = "train")')
    return walls


def wall_hashes(walls: Sequence[Wall]) -> dict[str, str]:
    """Return the name of each wall to the hash of its truths, independent of the path."""
    found: dict[str, str] = {}
    for wall in walls:
        places = (wall.truth, wall.truth / "gt.npz", wall.truth / "truth/gt.npz")
        file = next((place for place in places if place.is_file()), wall.truth)
        found[wall.name] = " ".join(filter(None, (found.get(wall.name), hash_path(file)[:12])))
    return found


def scan_names(walls: Sequence[str]) -> list[str]:
    """Return a name per scan, from its wall's name; several scans of one wall are numbered."""
    return [
        name if walls.count(name) == 1 else f"{name} #{walls[:k].count(name) + 1}"
        for k, name in enumerate(walls)
    ]


def _wall(row: dict[str, Any], path: Path) -> Wall:
    unknown = sorted(set(row) - {"name", "use", *_PATHS})
    if unknown:
        raise InputError(f"{path}: unknown keys in [[wall]]: {', '.join(unknown)}")
    lacking = [key for key in ("name", "use", "truth") if key not in row]
    if lacking:
        raise InputError(f"{path}: a [[wall]] lacks {', '.join(lacking)}")
    if row["use"] not in ("train", "test"):
        raise InputError(f"{path}: use: expected train or test, got {row['use']!r}")
    paths = {key: (path.parent / row[key]).resolve() for key in _PATHS if key in row}
    missing = [str(place) for place in paths.values() if not place.exists()]
    if missing:
        raise InputError(f"{path}: {missing[0]} does not exist")
    return Wall(str(row["name"]), row["use"], **paths)
