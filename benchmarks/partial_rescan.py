"""A rescan of the changed half of a generated wall, against the truth of the whole new wall.

    python -m benchmarks.partial_rescan OUT

A wall is generated and scanned. The routes of its left half are replaced, and only photos that aim
at the left half are taken of it; they are scanned with `sparse.part`. A hold counts as found at an
IoU over .5 on the joined mesh (guessed triangles left out). Untouched holds must be exactly as they
were. Files that OUT has already are kept.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from msgspec import structs

from walltopo.geometry.mesh_files import read_mesh
from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder, read_joined
from walltopo.scans.holds import Holds
from walltopo.scans.joined import Joined
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import carry_truth, overlap_with_missing
from walltopo_lab.evaluate.routes import match_pairs
from walltopo_lab.evaluate.scan import measured_labels, scan_views
from walltopo_lab.evaluate.truth import Truth, read_truth
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate

_WITHIN = 0.02  # metres over which truth is carried, as in `walltopo evaluate scan`
RECIPE = Recipe(
    GymSettings(width=5.0, height=3.2, columns=4, facets=0.5, volumes=2, routes=8),
    PhotoSettings(photos=40, width=960, height=720),
    seed=77,
)


@dataclass(frozen=True, eq=False)
class Rescan:
    """A wall, its new state after a reset of the left half, and both scans.

    Parameters
    ----------
    old, joined : scan folders; truths : of the wall before and after the reset.
    photos : number of photos of the left half.
    """

    old: ScanFolder
    joined: ScanFolder
    truths: tuple[Truth, Truth]
    photos: int

    @property
    def figures(self) -> Joined:
        """Return what the rescan replaced."""
        joined = read_joined(self.joined)
        assert joined is not None
        return joined

    def changed(self) -> list[int]:
        """Return the ids of holds that were not photographed, and yet are not as they were."""
        before, after = (
            {hold.id: hold for hold in Holds.load(folder.holds_raw).holds}
            for folder in (self.old, self.joined)
        )
        # Photos that show nothing of the old wall any more are left out.
        return [
            number
            for number in self.figures.stays
            if after[number] != structs.replace(before[number], photos=after[number].photos)
        ]

    def found(self, after: bool = True) -> dict[str, tuple[int, int, int]]:
        """Return for each half: true holds, those found, and holds of the scan.

        Parameters
        ----------
        after : of the joined scan, else of the first one.
        """
        folder, truth = (self.joined if after else self.old), self.truths[after]
        frame = align_views(scan_views(self.old, self.truths[0]), self.truths[0].views, False)
        whole = read_mesh(folder.mesh)
        mesh = frame.mesh(whole.without_guesses())
        carried = carry_truth(truth, mesh, _WITHIN)
        labels = measured_labels(folder, whole)
        pairs = match_pairs(overlap_with_missing(labels, carried, mesh.areas, truth))
        middle, rows = middle_of(truth), Holds.load(folder.holds).holds
        places = frame.apply(np.array([hold.position for hold in rows]))
        sides = {h.id: bool(place[0] < middle) for h, place in zip(rows, places, strict=True)}
        true = {item.id: item.position[0] < middle for item in truth.instances.values()}
        hits = [true[b] for a, b in pairs.items() if a in sides and b in true]
        every = list(true.values()), hits, list(sides.values())
        left = [sum(those) for those in every]
        right = [len(those) - count for those, count in zip(every, left, strict=True)]
        return {"left": (left[0], left[1], left[2]), "right": (right[0], right[1], right[2])}


def middle_of(truth: Truth) -> float:
    """Return the x in the middle of a wall's instances."""
    x = [item.position[0] for item in truth.instances.values()]
    return (min(x) + max(x)) / 2


def photos_of_the_left(truth: Truth, cameras: Path) -> list[str]:
    """Return the names of the photos whose middle is left of the wall's middle."""
    depth = float(np.median([item.position[1] for item in truth.instances.values()]))
    names = []
    for view in read_views(cameras):
        ahead = view.centre + view.direction * (depth - view.centre[1]) / view.direction[1]
        if ahead[0] < middle_of(truth):
            names.append(view.name)
    return names


def rescan_left_half(out: Path, recipe: Recipe, words: Sequence[str] = ()) -> Rescan:
    """Generate a wall, scan it, replace the routes of its left half, and rescan that half.

    Parameters
    ----------
    out : folder; what is there is kept.
    words : settings of both scans, `section.key=value`.
    """
    reset = replace(
        recipe, reset_seed=recipe.seed + 1, reset_part="left", photo_seed=recipe.seed + 1
    )
    generate(out / "before", recipe)
    generate(out / "after", reset)
    truth = read_truth(out / "after/truth")
    names = photos_of_the_left(truth, out / "after/truth/cameras")
    (out / "left").mkdir(exist_ok=True)
    for name in names:
        shutil.copyfile(out / "after/photos" / name, out / "left" / name)
    old, joined = out / "old", out / "joined"
    scan(out / "before/photos", old, load_settings(None, words))
    part = [f"sparse.reference={json.dumps(str(old.absolute()))}", "sparse.part=true"]
    scan(out / "left", joined, load_settings(None, [*words, *part]))
    return read_rescan(out)


def read_rescan(out: Path) -> Rescan:
    """Return what `rescan_left_half` made in a folder, which may have moved since."""
    truths = read_truth(out / "before/truth"), read_truth(out / "after/truth")
    photos = len(list((out / "left").iterdir()))
    return Rescan(ScanFolder(out / "old"), ScanFolder(out / "joined"), truths, photos)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    args = parser.parse_args(arguments)
    made = rescan_left_half(args.out, RECIPE)
    figures = made.figures
    print(f"{made.photos} photos of the left half; {figures.summary}")
    print(f"untouched holds that changed: {len(made.changed())} of {len(figures.stays)}")
    for state, after in (("before", False), ("after", True)):
        for side, (true, hits, rows) in made.found(after).items():
            print(f"{state}, {side} half: {hits} of {true} true holds found, {rows} in the scan")


if __name__ == "__main__":
    main()
