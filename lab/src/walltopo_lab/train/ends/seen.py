"""Simulated scans of generated gyms: typical scan errors without rendering.

The true holds of each gym are known. A scan misses some holds, more of those with certain paints
(white on grey). Some missed holds remain as instances that few photos confirm. Positions have small
errors. Sizes are measured on the hold's own shape with scan artefacts (`train.hold_types.scanned`),
from which the shipped network predicts its type. It does better there than on scans, so types are
confused as on two real scans (`set_gyms.CALLED`). Every hold is faded and lit individually,
so that its paint and colour name have errors. A few false holds are added, and a downclimb jug may
count as a hold of a route. Then the product groups the holds.

The error rates are measured on scans of generated gyms: recall and precision of the shown holds
(docs/results/shown-score.json), and the accuracy of routes by paint (routes-links.json).
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.types import MARGIN, Relief, render_heights, shipped_model
from walltopo.describe.routes import grouping as linking
from walltopo.describe.routes.find import describe_groups
from walltopo.describe.routes.grouping import group_by_paint
from walltopo.describe.settings import RoutesSettings
from walltopo.images.colour import features, linear_from_srgb8, srgb8_from_linear
from walltopo.scans.holds import UNKNOWN, Hold
from walltopo.scans.routes import Route
from walltopo_lab.synth.bodies import Body
from walltopo_lab.synth.palette import PALETTES
from walltopo_lab.synth.set_gyms import CALLED, PRESETS, SetGym, set_gym
from walltopo_lab.train.hold_types.scanned import GRID, scanned_relief
from walltopo_lab.train.paint.holds import straight_distances

Floats = NDArray[np.float64]

MISSED = 0.04  # mean share of holds that a scan misses
HARD = (
    0.08,
    0.2,
    0.6,
)  # share of paints with low contrast to the wall, and their range of missed shares
REMAINS = 0.5  # share of the missed holds that remain as low-coverage instances
FALSE = 0.03  # shown false holds per true hold; as many again have low confidence
SINGLE = 0.2  # share of routes with a single start hold, if their lowest hold fits both hands
TAKEN = 0.25  # share of the downclimb jugs that are not recognised
PLACE = 0.01  # metres: standard deviation of positions
DOUBTED = (0.5, 0.9)  # range of the confidence of a confused type
SCANS = 3  # simulated scans of each gym
TINT, SHADE = 0.06, 0.12  # standard deviation of a hold's log paint, per channel and overall


@dataclass(frozen=True)
class TrueEnds:
    """Ids of a true route's holds, of its start holds and of its top holds."""

    holds: frozenset[int]
    start: frozenset[int]
    top: frozenset[int]


@dataclass(frozen=True, eq=False)
class SeenGym:
    """A simulated scan and its ground truth.

    Parameters
    ----------
    holds : the holds that the scan shows; left_out : its low-confidence ones. Ids are those of the
        truth.
    part : id of a true hold to its part in its route: hold, foot, start, top.
    routes : the routes that the product finds; true : the true routes by number.
    """

    holds: list[Hold]
    left_out: list[Hold]
    part: dict[int, str]
    routes: list[Route]
    true: dict[int, TrueEnds]

    def matched(self) -> list[tuple[Route, TrueEnds | None]]:
        """Return each found route with the true route of most of its holds, else None."""
        route_of = {hold: number for number, ends in self.true.items() for hold in ends.holds}
        best: dict[int, tuple[int, int]] = {}
        for row, route in enumerate(self.routes):
            for number, count in Counter(
                route_of[hold] for hold in route.holds if hold in route_of
            ).items():
                if count > best.get(number, (0, 0))[0]:
                    best[number] = count, row
        owner: dict[int, list[int]] = defaultdict(list)
        for number, (_, row) in best.items():
            owner[row].append(number)
        found: list[tuple[Route, TrueEnds | None]] = []
        for row, route in enumerate(self.routes):
            numbers = owner.get(row, [])
            found += [(route, self.true[number]) for number in numbers] or [(route, None)]
        return found


@cache
def true_gym(seed: int) -> SetGym:
    """Return the gym of a seed; presets alternate."""
    return set_gym(PRESETS[seed % len(PRESETS)], seed)


def _with_single_starts(
    gym: SetGym, rng: np.random.Generator
) -> tuple[list[Hold], dict[int, TrueEnds]]:
    """Return the holds without the second start hold of some routes, and the remaining truth."""
    parts: dict[int, dict[str, list[Hold]]] = defaultdict(lambda: defaultdict(list))
    for hold in gym.holds:
        if hold.id in gym.route:
            parts[gym.route[hold.id]][gym.part[hold.id]].append(hold)
    gone, true = set(), {}
    usual = float(np.median([hold.size for hold in gym.holds]))
    for number, part in parts.items():
        start = sorted(part["start"], key=lambda hold: hold.position[2])
        if not start or not part["top"]:
            continue
        if len(start) == 2 and start[0].size >= usual and rng.random() < SINGLE:
            gone.add(start.pop().id)
        holds = {hold.id for some in part.values() for hold in some} - gone
        ends = (frozenset(hold.id for hold in some) for some in (start, part["top"]))
        true[number] = TrueEnds(frozenset(holds), *ends)
    return [hold for hold in gym.holds if hold.id not in gone], true


def _scanned_paints(rgb: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return (n, 3) paints as in a scan: each faded, chalked and lit individually."""
    linear = linear_from_srgb8(rgb)
    faded = rng.beta(1.2, 6, (len(rgb), 1))
    linear = (linear * (1 - faded) + 0.4 * faded) * np.exp(rng.normal(0, TINT, (len(rgb), 3)))
    return srgb8_from_linear(linear * np.exp(rng.normal(0, SHADE, (len(rgb), 1))))


def _nearest_names(rgb: NDArray[np.uint8]) -> list[str]:
    """Return the nearest colour name of the generator's palettes for each paint."""
    names = [name for palette in PALETTES.values() for name in palette] + ["grey"]
    paints = [rgb for palette in PALETTES.values() for rgb in palette.values()] + [(0.5, 0.5, 0.51)]
    entries = features(linear_from_srgb8((255 * np.array(paints)).astype(np.uint8)), 0.5)
    away = np.linalg.norm(features(linear_from_srgb8(rgb), 0.5)[:, None] - entries[None], axis=2)
    return [names[k] for k in away.argmin(axis=1)]


def _scanned_reliefs(bodies: Sequence[Body], rng: np.random.Generator) -> list[Relief | None]:
    """Return the reliefs of holds with scan artefacts."""
    cv2.setNumThreads(1)  # for images this small, starting threads takes longer than the work
    found = []
    for body in bodies:
        pixel = 2.9 * float(np.abs(body.vertices[:, :2]).max()) / GRID
        heights, there = render_heights(body.vertices * [1, -1, -1], body.faces, pixel * GRID, GRID)
        found.append(scanned_relief(np.where(there, np.maximum(heights, 0), 0.0), pixel, rng))
    return found


def _as_scanned(
    holds: list[Hold], bodies: Mapping[int, Body], rng: np.random.Generator
) -> list[Hold]:
    """Return the holds with a scan's position, size, type, paint and colour name.

    Holds without a relief are left out.
    """
    reliefs = _scanned_reliefs([bodies[hold.id] for hold in holds], rng)
    drawn = [(hold, relief) for hold, relief in zip(holds, reliefs, strict=True) if relief]
    looks = _scanned_paints(np.array([hold.colour_rgb for hold, _ in drawn], dtype=np.uint8), rng)
    types = shipped_model().names_of([relief for _, relief in drawn])
    names = _nearest_names(looks)
    seen = []
    for k, (hold, relief) in enumerate(drawn):
        x, y, z = (np.array(hold.position) + rng.normal(0, PLACE, 3)).tolist()
        red, green, blue = looks[k].tolist()
        name, sure = types[k]
        seen.append(
            replace(
                hold,
                position=(x, y, z),
                size=relief.side_m / MARGIN,
                colour=names[k],
                colour_rgb=(red, green, blue),
                type=name,
                role="hold",
                type_confidence=sure if name != UNKNOWN else 0.0,
            )
        )
    return seen


def _confuse_types(
    holds: Sequence[Hold], true: Mapping[int, str], rng: np.random.Generator
) -> list[Hold]:
    """Return the holds with types confused as in scans."""
    found = []
    for hold in holds:
        if hold.id in true:
            counts = CALLED[true[hold.id]]
            odds = np.array(list(counts.values())) / sum(counts.values())
            name, sure = str(rng.choice(list(counts), p=odds)), rng.uniform(*DOUBTED)
            if name != hold.type:
                sure = 0.0 if name == UNKNOWN else float(sure)
                hold = replace(hold, type=name, type_confidence=sure)
        found.append(hold)
    return found


def _found_mask(holds: list[Hold], rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return (n,) whether a scan finds each hold."""
    usual = rng.beta(1.2, 1.2 / MISSED - 1.2)
    share, low, high = HARD
    rate = {
        name: rng.uniform(low, high) if rng.random() < share else usual
        for name in sorted({hold.colour for hold in holds})
    }
    small = {"foothold": 1.5}
    return np.array(
        [rng.random() >= min(0.95, small.get(h.type, 1.0) * rate[h.colour]) for h in holds]
    )


def _false_holds(holds: list[Hold], count: int, rng: np.random.Generator) -> list[Hold]:
    """Return false holds, near true holds and with the appearance of random true holds."""
    made = []
    for k in range(count):
        at, like = holds[int(rng.integers(len(holds)))], holds[int(rng.integers(len(holds)))]
        x, y, z = (np.array(at.position) + rng.normal(0, 0.4, 3) * (1, 0.1, 1)).tolist()
        size = float(like.size * rng.uniform(0.4, 1.2))
        made.append(
            replace(like, id=10_000 + k, position=(x, y, abs(z)), size=size, type="unknown")
        )
    return made


def simulate_scan(seed: int, scan: int = 0) -> SeenGym:
    """Return one simulated scan of the gym of a seed, with holds grouped by the product."""
    rng = np.random.default_rng([29, seed, scan])
    gym = true_gym(seed)
    there, true = _with_single_starts(gym, rng)
    there = [hold for hold in there if hold.role == "hold" or rng.random() < TAKEN]
    found = _found_mask(there, rng)
    met = {hold.id for hold, here in zip(there, found, strict=True) if here}
    known = _as_scanned(there, gym.body, rng)
    shown = [hold for hold in known if hold.id in met]
    missed = [hold for hold in known if hold.id not in met]
    wrong = _false_holds(known, int(rng.binomial(len(known), 2 * FALSE)), rng)
    shown += wrong[::2]
    spare = [hold for hold in missed if rng.random() < REMAINS] + wrong[1::2]
    types = {hold.id: hold.type for hold in gym.holds}
    doubt = np.random.default_rng([17, seed, scan])
    shown, spare = _confuse_types(shown, types, doubt), _confuse_types(spare, types, doubt)
    left_out = [replace(hold, left_out="few photos confirm it") for hold in spare]
    points = np.array([hold.position for hold in shown])
    rgb = np.array([hold.colour_rgb for hold in shown], dtype=np.uint8)
    grouping = group_by_paint(
        points,
        linking.balanced_paint(linear_from_srgb8(rgb), np.ones((len(shown), 3))),
        lambda pairs: straight_distances(points, pairs, linking.FLATTEN),
        unit=1.0,
        resolution=linking.RESOLUTION,
    )
    routes, _ = describe_groups(shown, shown, grouping, RoutesSettings(), left_out)
    return SeenGym(shown, left_out, gym.part, routes, true)
