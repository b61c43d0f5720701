"""The list of labelled walls: which to tune on and which to report on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walltopo.core import InputError
from walltopo.core.files import hash_path
from walltopo.core.toml import read_toml

_PATHS = ("truth", "scan", "mesh", "cameras", "masks")


@dataclass(frozen=True)
class Wall:
    """One labelled wall.

    Parameters
    ----------
    name : of the wall itself, the same for all scans of one wall, before and after a reset too.
    use : train or test.
    truth : folder of the ground truth.
    scan : a scan folder of it; or None, and then:
    mesh, cameras, masks : what to lift, in place of a scan's; None: the truth's own mesh, its
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
    """Read a list of walls, TOML; paths are relative to it.

    `[[wall]]` tables with `name`, `use` ("train" or "test"), `truth`, and `scan` or any of `mesh`,
    `cameras`, `masks`.

    Raises
    ------
    InputError : broken; or a wall is both tuned and reported on, which would report what was
        learned by heart.
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


def contents(walls: Sequence[Wall]) -> dict[str, str]:
    """Name of each wall to the hash of its truths: the same on all machines, wherever they lie."""
    found: dict[str, str] = {}
    for wall in walls:
        places = (wall.truth, wall.truth / "gt.npz", wall.truth / "truth/gt.npz")
        file = next((place for place in places if place.is_file()), wall.truth)
        found[wall.name] = " ".join(filter(None, (found.get(wall.name), hash_path(file)[:12])))
    return found


def scan_names(walls: Sequence[str]) -> list[str]:
    """Names of scans by those of their walls; several scans of one wall are numbered."""
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
