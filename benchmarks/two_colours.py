"""Two-coloured holds of generated gyms that chose nothing, with their true instances.

    python -m benchmarks.two_colours FOLDER [--seeds 6200 6201 ...]

Makes the gyms in FOLDER where they are missing: a quarter of their holds has two colours; four kinds
of palette, chalk and light; 14 photos of 1024 x 768 each. A two-coloured hold counts if a tenth to
nine tenths of its pixels in the photos show the second colour; both names are right if they are
those of the parts, in either order. A name of the palette stands for the true colour of most of its
one-coloured holds. The last columns are the adjusted Rand index of the routes with the second
colours and without.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from benchmarks.colours import scale, true_names
from walltopo.describe.classify.achromatic import found_colours
from walltopo.describe.classify.attributes import with_second_colour, with_tints
from walltopo.describe.classify.colour import HoldColour, paint_over_views
from walltopo.describe.classify.geometry import measure_shapes
from walltopo.describe.classify.two_colours import second_colours, split_paints
from walltopo.describe.routes.find import find_routes
from walltopo.describe.settings import ClassifySettings, RoutesSettings
from walltopo.scans.holds import Hold
from walltopo_lab.evaluate.routes import route_metrics
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate
from walltopo_lab.train.two_colours.fit import VISIBLE
from walltopo_lab.train.two_colours.views import GymViews, read_gym_views

PHOTOS = PhotoSettings(photos=14, width=1024, height=768, measure_share=0.1)
GYM = GymSettings(width=6.0, routes=8, two_coloured=0.25)


def recipe_of(seed: int) -> Recipe:
    """Return the recipe of one of the four kinds of gyms."""
    kinds = (
        dataclasses.replace(GYM, chalk=0.3),
        dataclasses.replace(GYM, colours="faded", chalk=0.8, light=0.5, finish="plywood", wear=0.7),
        dataclasses.replace(GYM, colours="neutral", light=1.2, finish="textured"),
        dataclasses.replace(GYM, chalk=0.7, light=0.6, warmth=0.6),
    )
    return Recipe(kinds[seed % len(kinds)], PHOTOS, seed=seed)


@dataclass
class Counts:
    """What was found on a gym.

    Parameters
    ----------
    two, both, found : two-coloured holds, those with both names right, those found to have two.
    one, false : one-coloured holds, and those called two-coloured.
    ari, ari_first : of the routes with the second colours, and without.
    """

    two: int = 0
    both: int = 0
    found: int = 0
    one: int = 0
    false: int = 0
    ari: float = 0.0
    ari_first: float = 0.0

    def __str__(self) -> str:
        return (
            f"{self.both} of {self.two} | {self.found} of {self.two} | {self.false} of {self.one} "
            f"| {self.ari:.3f} | {self.ari_first:.3f}"
        )


def measure(gym: GymViews) -> Counts:
    """Return what is found on a gym with the settings of a scan."""
    settings = ClassifySettings()
    alike = scale(settings)
    shapes = measure_shapes(gym.truth.mesh, gym.truth.face_instance, sorted(gym.views))
    views = {number: rows for number, rows in gym.views.items() if number in shapes}
    places = {number: shape.position for number, shape in shapes.items()}
    paints, second = split_paints(paint_over_views(views, gym.light), views, gym.light, ())
    palette, colours = found_colours(paints, places, (), (), second, upright=True, **alike)
    seconds = second_colours(second, colours, palette, **alike)
    counts = _named(gym, colours, seconds)
    holds = []
    for number, colour in colours.items():
        x, y, z = places[number].tolist()
        nx, ny, nz = shapes[number].normal.tolist()
        hold = Hold(
            number,
            "hold",
            colour=colour.name,
            colour_rgb=colour.rgb,
            position=(x, y, z),
            normal=(nx, ny, nz),
            role="downclimb" if gym.truth.instances[number].route < 0 else "hold",
        )
        holds.append(with_second_colour(hold, seconds.get(number)))
    holds = with_tints(holds, gym.light, 1.0)
    counts.ari = _ari(gym, holds)
    counts.ari_first = _ari(gym, [replace(hold, second_colour="") for hold in holds])
    return counts


def _named(
    gym: GymViews, colours: Mapping[int, HoldColour], seconds: Mapping[int, HoldColour]
) -> Counts:
    """Count right and wrong names."""
    truth = gym.truth.instances
    meant = true_names(
        {number: colour.name for number, colour in colours.items()},
        {number: one.colour for number, one in truth.items() if len(one.colours) == 1},
    )
    counts = Counts()
    for number, colour in colours.items():
        if len(truth[number].colours) == 1:
            counts.one += 1
            counts.false += number in seconds
        elif VISIBLE[0] <= gym.visible_share(number) <= VISIBLE[1]:
            counts.two += 1
            counts.found += number in seconds
            if number in seconds:
                names = {meant.get(name, name) for name in (colour.name, seconds[number].name)}
                counts.both += names == set(truth[number].colours)
    return counts


def _ari(gym: GymViews, holds: list[Hold]) -> float:
    """Return the adjusted Rand index of the routes that holds give."""
    routes, _ = find_routes(gym.truth.mesh, holds, RoutesSettings())
    pairs = {hold.id: hold.id for hold in holds}
    return float(route_metrics(routes, pairs, gym.truth.instances)["ari"])


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="where the gyms are made")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(6200, 6208)))
    options = parser.parse_args()
    print(
        "| gym | both names right | two colours found | one-coloured called two | ARI | without |"
    )
    print("|---|---|---|---|---|---|")
    rows = []
    for seed in options.seeds:
        generate(options.folder / str(seed), recipe_of(seed))
        rows.append(measure(read_gym_views(options.folder / str(seed))))
        print(f"| {seed} | {rows[-1]} |", flush=True)
    whole = Counts(
        two=sum(row.two for row in rows),
        both=sum(row.both for row in rows),
        found=sum(row.found for row in rows),
        one=sum(row.one for row in rows),
        false=sum(row.false for row in rows),
        ari=float(np.mean([row.ari for row in rows])),
        ari_first=float(np.mean([row.ari_first for row in rows])),
    )
    print(f"| all | {whole} |")


if __name__ == "__main__":
    main()
