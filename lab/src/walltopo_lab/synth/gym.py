"""Construction of a gym from a seed: walls, volumes, routes, scale plates, bitmaps and light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from walltopo.core import Progress, SettingsError, Silent
from walltopo_lab.synth.atlas import Atlas, build_atlas
from walltopo_lab.synth.bodies import Body, Facet, GymInstance
from walltopo_lab.synth.hall import (
    Section,
    Stand,
    hall_bay,
    moved_facet,
    moved_instance,
    ring_of_walls,
)
from walltopo_lab.synth.light import Baked, Lamps, bake_light, hang_lamps
from walltopo_lab.synth.marks import Tag
from walltopo_lab.synth.measure import place_plates
from walltopo_lab.synth.mesh import Surface, merge_surface
from walltopo_lab.synth.paint import PaintWork
from walltopo_lab.synth.params import GymSettings
from walltopo_lab.synth.setter import MakeHold, SetWall, set_downclimbs, set_routes
from walltopo_lab.synth.stickers import place_stickers
from walltopo_lab.synth.tnuts import sockets_of
from walltopo_lab.synth.tracer import Tracer
from walltopo_lab.synth.two_colours import paint_second_colours
from walltopo_lab.synth.volumes import place_volumes, volume_footprint
from walltopo_lab.synth.wall import build_hall, build_wall
from walltopo_lab.synth.wear import Wear, wear_holds

_LAMP_REACH = 12.0  # m; a lamp farther away adds a hundredth of the nearest lamp's light
RESET_PARTS = ("all", "left", "middle", "right")


@dataclass(frozen=True)
class Reset:
    """A reset: the routes on a part of the wall, replaced by new ones.

    Parameters
    ----------
    seed : seed of the new routes.
    part : all, left, middle or right (of the wall: halves, and the middle third).
    """

    seed: int
    part: str = "all"

    def __post_init__(self) -> None:
        if self.part not in RESET_PARTS:
            raise SettingsError(
                f"synth reset part: expected one of {', '.join(RESET_PARTS)}, got {self.part!r}"
            )

    def interval(self, low: float, high: float) -> tuple[float, float]:
        """Return the x interval of the reset."""
        third = (high - low) / 3
        middle = (low + high) / 2
        return {
            "all": (low, high),
            "left": (low, middle),
            "right": (middle, high),
            "middle": (low + third, high - third),
        }[self.part]


@dataclass(frozen=True, eq=False)
class Gym:
    """A complete gym, ready to be photographed.

    Parameters
    ----------
    sections : each wall with its scale plates in its own frame, and its position in the hall.
    facets : wall facets first, then volumes, plates and the hall.
    wall : the walls' facets alone.
    plates : the scale plates' facets.
    instances : volumes, then holds; ids are unique but may have gaps after a reset.
    tags : the start tags as drawn.
    wear : the holds that turned, shifted or are gone; None for a gym as it was set.
    """

    settings: GymSettings
    seed: int
    reset: Reset | None
    sections: list[Section]
    facets: list[Facet]
    wall: list[Facet]
    plates: list[Facet]
    instances: list[GymInstance]
    tags: list[Tag]
    surface: Surface
    atlas: Atlas
    baked: Baked
    tracer: Tracer
    wear: Wear | None = None


def _procedural(settings: GymSettings) -> MakeHold:
    from walltopo_lab.synth.holds import make_hold

    def make(kind: str, style: str, rng: np.random.Generator, scale: float) -> Body:
        return make_hold(kind, style, rng, scale, settings.detail)

    return make


def _lanes(span: tuple[float, float], count: int, spray: bool) -> list[tuple[float, float]]:
    low, high = span
    if spray:
        return [(low + 0.1, high - 0.1)] * count
    width = (high - low) / count
    slack = 0.1 * width
    return [(low + k * width - slack, low + (k + 1) * width + slack) for k in range(count)]


def _set_wall(
    wall: SetWall,
    settings: GymSettings,
    seed: int,
    number: int,
    reset: Reset | None,
    make: MakeHold,
) -> None:
    """Set all routes; for a reset, remove those of its part and set new ones."""
    x = wall.sockets.points[:, 0]
    span = (float(x.min()), float(x.max()))
    rng = np.random.default_rng([seed, 3, number])
    set_downclimbs(wall, settings, make, np.random.default_rng([seed, 4, number]))
    set_routes(wall, _lanes(span, settings.routes, settings.spray), 0, settings, make, rng)
    if reset is None:
        return
    low, high = reset.interval(*span)
    middles: dict[int, list[float]] = {}
    for hold in wall.holds:
        middles.setdefault(hold.route, []).append(float(hold.position[0]))
    gone = {r for r, xs in middles.items() if r >= 0 and low <= float(np.mean(xs)) <= high}
    wall.holds[:] = [hold for hold in wall.holds if hold.route not in gone]
    lanes = _lanes((low, high), max(1, len(gone)), settings.spray)
    fresh = np.random.default_rng([reset.seed, 5])
    set_routes(wall, lanes, settings.routes, settings, make, fresh)


@dataclass(frozen=True, eq=False)
class SetUp:
    """A gym before bitmaps and light: walls, plates, volumes and holds.

    Parameters
    ----------
    sections : each wall with its scale plates in its own frame, and its position in the hall.
    wall, plates : facets of the walls and of the scale plates.
    facets : all facets: wall, volumes, plates (wall by wall), then the hall.
    volumes, holds : the instances.
    """

    sections: list[Section]
    wall: list[Facet]
    plates: list[Facet]
    facets: list[Facet]
    volumes: list[GymInstance]
    holds: list[GymInstance]

    @property
    def instances(self) -> list[GymInstance]:
        return [*self.volumes, *self.holds]


def set_up(
    settings: GymSettings, seed: int, reset: Reset | None = None, make_hold: MakeHold | None = None
) -> SetUp:
    """Build the walls, add volumes, set routes and place the scale plates; see `make_gym`."""
    make = make_hold or _procedural(settings)
    if settings.walls == 1:
        built = _one_wall(settings, seed, 0, range(settings.plates), reset, make)
        return replace(built, facets=[*built.facets, *build_hall(built.wall, settings)])
    if reset is not None:
        raise SettingsError(
            f"synth reset: expected a gym of one wall, this one has {settings.walls}",
            "Generate another hall with another --seed instead.",
        )
    return _around_a_floor(settings, seed, make)


def _one_wall(
    settings: GymSettings,
    seed: int,
    number: int,
    plate_numbers: Sequence[int],
    reset: Reset | None,
    make: MakeHold,
) -> SetUp:
    """Return one complete wall in its own frame, without a hall around it."""
    # A trailing 0 leaves a seed unchanged, so a hall's first wall equals the single-wall gym of
    # that seed.
    wall = build_wall(settings, np.random.default_rng([seed, 1, number]))
    volume_facets, volumes = place_volumes(wall, settings, np.random.default_rng([seed, 2, number]))
    hosts = [*wall, *volume_facets]
    set_wall = SetWall(sockets_of(hosts), hosts, len(volumes) + 1)
    set_wall.blocked += [
        (v.position, 0.8 * volume_footprint(v, volume_facets), v.id) for v in volumes
    ]
    _set_wall(set_wall, settings, seed, number, reset, make)
    if settings.two_coloured:
        painted = paint_second_colours(set_wall.holds, settings, (seed, 13, number))
        set_wall.holds[:] = painted
    plates = place_plates(wall, plate_numbers, np.random.default_rng([seed, 6, number]))
    section = Section(wall, plates, None)
    chance = np.random.default_rng([seed, 12, number])
    codes = range(number * settings.stickers, (number + 1) * settings.stickers)
    stickers = place_stickers(wall, set_wall.holds, codes, chance)
    facets = [*hosts, *plates, *stickers]
    return SetUp([section], wall, plates, facets, volumes, set_wall.holds)


def _around_a_floor(settings: GymSettings, seed: int, make: MakeHold) -> SetUp:
    """Return the walls of a hall; ids and route numbers continue from wall to wall."""
    spread = [number * settings.walls // settings.plates for number in range(settings.plates)]
    built = [
        _one_wall(settings, seed, k, [p for p, at in enumerate(spread) if at == k], None, make)
        for k in range(settings.walls)
    ]
    back = 0.8 + max(float(facet.corners[:, 1].max()) for one in built for facet in one.wall)
    hall = SetUp([], [], [], [], [], [])
    shell: list[Facet] = []
    ids = 0
    for number, (one, stand) in enumerate(
        zip(built, ring_of_walls(settings.walls, settings.width), strict=True)
    ):
        _put_up(hall, one, stand, ids, number * settings.routes)
        ids = max((item.id for item in hall.instances), default=0)
        floor_and_rear = hall_bay(stand, settings, back, number)
        shell += [moved_facet(facet, stand.hall_from_wall) for facet in floor_and_rear]
    return replace(hall, facets=[*hall.facets, *shell])


def _put_up(hall: SetUp, one: SetUp, stand: Stand, ids: int, routes: int) -> None:
    """Add a wall to the hall, in the hall's frame."""
    move = stand.hall_from_wall
    hall.sections.append(Section(one.wall, one.plates, stand))
    hall.wall.extend(moved_facet(facet, move) for facet in one.wall)
    hall.plates.extend(moved_facet(facet, move) for facet in one.plates)
    hall.facets.extend(moved_facet(facet, move, ids) for facet in one.facets)
    hall.volumes.extend(moved_instance(item, move, ids, routes) for item in one.volumes)
    hall.holds.extend(moved_instance(item, move, ids, routes) for item in one.holds)


def _place_lamps(sections: Sequence[Section], settings: GymSettings, seed: int) -> Lamps:
    """Return the lamps of all walls, in the first wall's lamp colour."""
    hung = [
        hang_lamps(section.wall, settings, np.random.default_rng([seed, 7, number]))
        for number, section in enumerate(sections)
    ]
    centres = [
        section.hall_from_wall.apply(lamps.centres)
        for section, lamps in zip(sections, hung, strict=True)
    ]
    power = np.concatenate([lamps.power for lamps in hung])
    return replace(hung[0], centres=np.concatenate(centres), power=power)


def make_gym(
    settings: GymSettings,
    seed: int,
    reset: Reset | None = None,
    make_hold: MakeHold | None = None,
    progress: Progress | None = None,
    wear_seed: int | None = None,
) -> Gym:
    """Build a gym; the same arguments give the same gym.

    Parameters
    ----------
    settings : see `GymSettings` and `gym_preset`.
    seed : >= 0; decides everything that varies.
    reset : replace the routes of a part of the wall; wall, volumes and light stay.
    make_hold : source of holds; procedural by default.
    progress : receives the steps.
    wear_seed : the gym some weeks later, when holds have turned, shifted or gone; all marks on the
        wall stay.
    """
    progress = progress or Silent()
    progress.step("building the gym")
    built = set_up(settings, seed, reset, make_hold)
    work = PaintWork(settings, seed, built.holds, {v.id: v for v in built.volumes})
    atlas = build_atlas(built.facets, work, seed)
    wear = None
    if wear_seed is not None:
        rng = np.random.default_rng([wear_seed, 14])
        holds, wear = wear_holds(built.holds, built.facets, rng)
        built = replace(built, holds=holds)
    surface = merge_surface(built.facets, built.holds, settings.cell)
    progress.step("lighting the gym")
    tracer = Tracer(surface.vertices, surface.faces)
    lamps = _place_lamps(built.sections, settings, seed)
    baked = bake_light(
        surface, tracer, lamps, settings, _LAMP_REACH if settings.walls > 1 else np.inf
    )
    return Gym(
        settings,
        seed,
        reset,
        built.sections,
        built.facets,
        built.wall,
        built.plates,
        built.instances,
        work.tags,
        surface,
        atlas,
        baked,
        tracer,
        wear,
    )
