"""Colour accuracy on the rendered gym with its true instances.

    python -m benchmarks.colours [DATA]
    python -m benchmarks.colours gyms GYM [GYM ...]    gyms of `walltopo synth`
    python -m benchmarks.colours names OUT             white, grey and black by name

DATA is the folder of the test data (default ../shared/data). The output covers the untrained
default on both scans of the gym, and the first scan with a palette learnt on the other
(`gym-a-reset`). There the truth plays the setter: each cluster of that scan gets the name of its
holds' majority. `names` generates eight gyms with white, grey and black routes beside red, yellow
and blue ones, under dim to bright light, on panels of all paints (12 photos of 960 x 720 each).
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh, Silent, View
from walltopo.describe.classify.achromatic import ACHROMATIC, found_colours
from walltopo.describe.classify.colour import (
    HoldColour,
    HoldPaint,
    assign_colours,
    paint_over_views,
    with_white,
)
from walltopo.describe.classify.geometry import measure_shapes
from walltopo.describe.classify.light import observe
from walltopo.describe.classify.palette import Entry
from walltopo.describe.settings import ClassifySettings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.photos import PhotoSet
from walltopo_lab.evaluate.truth import CLASS_IDS, read_truth
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate

CLASSES = {number: name for name, number in CLASS_IDS.items()}
RADIAL = 0.035  # k1 of the photos of both scans; see the data's README


def true_scan(
    folder: Path, lift: bool
) -> tuple[list[View], Mesh, NDArray[np.int32], dict[int, str], dict[int, str]]:
    """Return views, mesh, face labels, true colours and classes of one scan of the gym.

    lift : use the reconstruction-like mesh instead of the true one.
    """
    truth = np.load(folder / "gt.npz")
    source = np.load(folder / "lift" / "gt.npz") if lift else truth
    mesh = Mesh(source["vertices"], source["faces"])
    focal, _, cx, cy = (float(v) for v in truth["intrinsics"])
    width, height = (int(v) for v in truth["size"])
    camera = Camera("SIMPLE_RADIAL", width, height, (focal, cx, cy, RADIAL))
    views = [
        View(f"IMG_{number:04d}.jpg", camera, pose)
        for number, pose in enumerate(truth["cam_from_world"])
    ]
    scene = json.loads((folder / "scene.json").read_text(encoding="utf-8"))
    colours = {entry["id"]: entry["colour"] for entry in scene["instances"]}
    kinds = {entry["id"]: entry["class"] for entry in scene["instances"]}
    return views, mesh, source["face_instance"].astype(np.int32), colours, kinds


def scale(settings: ClassifySettings) -> dict[str, float]:
    """Return the settings that decide which colours are equal."""
    return {"spread": settings.colour_spread, "lightness_weight": settings.lightness_weight}


def generated_scan(
    folder: Path,
) -> tuple[list[View], Mesh, NDArray[np.int32], dict[int, str], dict[int, str]]:
    """Return the data of `true_scan` for a gym of `walltopo synth`."""
    truth = read_truth(folder)
    kinds = {number: CLASSES[one.label] for number, one in truth.instances.items()}
    colours = {number: one.colour for number, one in truth.instances.items()}
    views = read_views(folder / "truth" / "cameras")
    return views, truth.mesh, truth.face_instance, colours, kinds


@dataclass(frozen=True)
class Painted:
    """The true instances of a scan as its photos show them.

    Parameters
    ----------
    paints : of each visible instance, by id; places : (3,) positions, metres.
    truth : true colour of each instance; volumes : ids of the volumes.
    """

    paints: dict[int, HoldPaint]
    places: dict[int, NDArray[np.float64]]
    truth: dict[int, str]
    volumes: set[int]

    def found(self, settings: ClassifySettings) -> tuple[list[Entry], dict[int, HoldColour]]:
        """Return palette and colours without anything given, as a scan finds them."""
        return found_colours(
            self.paints, self.places, self.volumes, (), upright=True, **scale(settings)
        )

    def holds(self, settings: ClassifySettings) -> dict[int, HoldColour]:
        """Return the colours of the holds, without volumes."""
        colours = self.found(settings)[1]
        return {number: one for number, one in colours.items() if number not in self.volumes}


def painted(folder: Path, lift: bool | None, settings: ClassifySettings) -> Painted:
    """Return the true instances of a scan with their paints.

    lift : see `true_scan`; None: a gym of `walltopo synth`.
    """
    source = generated_scan(folder) if lift is None else true_scan(folder, lift)
    views, mesh, labels, colours, kinds = source
    seen, light = observe(views, PhotoSet(folder / "photos"), mesh, labels, settings, Silent())
    shapes = measure_shapes(mesh, labels, sorted(colours))
    positions = {number: shape.position for number, shape in shapes.items()}
    seen = {number: rows for number, rows in sorted(seen.items()) if number in positions}
    volumes = {number for number, kind in kinds.items() if kind == "volume"}
    light = with_white(light, seen)
    return Painted(paint_over_views(seen, light), positions, colours, volumes)


def true_names(found: Mapping[int, str], truth: Mapping[int, str]) -> dict[str, str]:
    """Return each found name's meaning: the true colour of most of its holds.

    Parameters
    ----------
    found, truth : hold id to the found and to the true name; holds without a truth do not count.
    """
    holds: dict[str, list[str]] = {}
    for number, name in found.items():
        if number in truth:
            holds.setdefault(name, []).append(truth[number])
    return {name: Counter(colours).most_common(1)[0][0] for name, colours in holds.items()}


def review(folders: list[Path], settings: ClassifySettings) -> None:
    """Print the share of generated holds in the right colour group, and the review list.

    A palette entry stands for the true colour of most of its holds.
    """
    listed, wrong = [], []
    for folder in folders:
        gym = painted(folder, None, settings)
        holds, truth = gym.holds(settings), gym.truth
        meant = true_names({number: colour.name for number, colour in holds.items()}, truth)
        off = [meant[colour.name] != truth[number] for number, colour in holds.items()]
        print(f"{folder.name}: {len(off) - sum(off)} of {len(off)} right", flush=True)
        wrong += off
        listed += [colour.confidence < settings.review_below for colour in holds.values()]
    hits = sum(a and b for a, b in zip(listed, wrong, strict=True))
    print(
        f"review list: {sum(listed)} of {len(listed)} holds, {hits} of them among the "
        f"{sum(wrong)} wrong ones"
    )


_LIGHTS = (1.0, 0.35, 1.6, 0.7, 1.2, 0.5, 1.0, 0.8)
_FINISHES: tuple[Literal["painted", "textured", "plywood"], ...] = (
    "painted",
    "textured",
    "painted",
    "plywood",
)
_FIRST_SEED = 5300


def names(out: Path, settings: ClassifySettings) -> None:
    """Print how many holds have their colour's own name, achromatic ones and all."""
    photos = PhotoSettings(photos=12, width=960, height=720, noise=2.0, measure_share=0.1)
    grey_right, grey_all, right, total = 0, 0, 0, 0
    for k, light in enumerate(_LIGHTS):
        seed = _FIRST_SEED + k
        gym = GymSettings(
            width=7.0,
            routes=9,
            colours="neutral",
            light=light,
            finish=_FINISHES[k % 4],
            chalk=(0.3, 0.8)[k % 2],
        )
        generate(out / str(seed), Recipe(gym, photos, seed=seed))
        seen = painted(out / str(seed), None, settings)
        holds, truth = seen.holds(settings), seen.truth
        achromatic = [number for number in holds if truth[number] in ACHROMATIC]
        own = sum(holds[number].name == truth[number] for number in achromatic)
        print(f"{seed}: {own} of {len(achromatic)} white, grey and black holds", flush=True)
        grey_right, grey_all = grey_right + own, grey_all + len(achromatic)
        right += sum(colour.name == truth[number] for number, colour in holds.items())
        total += len(holds)
    print(
        f"right by name: {grey_right} of {grey_all} white, grey and black, {right} of {total} all"
    )


def setters_palette(
    paints: dict[int, HoldPaint],
    colours: dict[int, str],
    entries: list[Entry],
    settings: ClassifySettings,
) -> list[Entry]:
    """Return the palette of a scan, with the clusters named by a setter who knows the truth."""
    found = assign_colours(paints, entries, **scale(settings))
    meant = true_names({hold: colour.name for hold, colour in found.items()}, colours)
    return [
        Entry(meant[entry.name], entry.rgb, entry.role) for entry in entries if entry.name in meant
    ]


def report(
    title: str, palette: list[Entry], found: dict[int, HoldColour], truth: dict[int, str]
) -> None:
    """Print the accuracy and the confusions."""
    right = sum(found[hold].name == truth[hold] for hold in found)
    missed = len(truth) - len(found)
    print(f"{title}: {right} of {len(found)} right ({missed} instances not seen)")
    print("  palette:", ", ".join(f"{entry.name} {entry.rgb}" for entry in palette))
    wrong = Counter((truth[h], found[h].name) for h in found if found[h].name != truth[h])
    for (was, called), count in wrong.most_common():
        print(f"  {was} called {called}: {count}")


def main() -> None:
    settings = ClassifySettings()
    if sys.argv[1:2] == ["gyms"]:
        review([Path(word) for word in sys.argv[2:]], settings)
        return
    if sys.argv[1:2] == ["names"]:
        names(Path(sys.argv[2]), settings)
        return
    data = Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data")
    first = painted(data / "gym-a", True, settings)
    second = painted(data / "gym-a-reset", False, settings)
    report("gym-a, nothing given", *first.found(settings), first.truth)
    entries, colours = second.found(settings)
    report("gym-a-reset, nothing given", entries, colours, second.truth)
    palette = setters_palette(second.paints, second.truth, entries, settings)
    known = assign_colours(first.paints, palette, **scale(settings))
    report("gym-a, palette of gym-a-reset", palette, known, first.truth)


if __name__ == "__main__":
    main()
