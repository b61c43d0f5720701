"""Colour, type, shape and role of each instance, from the scan's files and photos."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol

import numpy as np
from msgspec.structs import replace

from walltopo.core import EnvironmentLacksError, Mesh, Progress, SettingsError, View
from walltopo.describe.classify.achromatic import found_colours
from walltopo.describe.classify.colour import (
    HoldColour,
    HoldPaint,
    assign_colours,
    paint_over_views,
    with_white,
)
from walltopo.describe.classify.geometry import Shape, measure_shapes
from walltopo.describe.classify.light import TINT_RADIUS, observe
from walltopo.describe.classify.low_confidence import (
    Lifted,
    low_confidence_reasons,
    low_confidence_rows,
)
from walltopo.describe.classify.observations import HoldView, best_views, write_cutouts
from walltopo.describe.classify.palette import Entry, read_palette
from walltopo.describe.classify.two_colours import second_colours, split_paints
from walltopo.describe.classify.types import Relief, reliefs, shipped_model
from walltopo.describe.settings import ClassifySettings
from walltopo.geometry.graphs import components
from walltopo.scans.holds import UNKNOWN, Hold, Holds, MeasuredWith, PaletteColour, Role
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import Cutouts, SceneLight
from walltopo.scans.scale import Scale, unit_of, unit_of_sizes


@dataclass(frozen=True, eq=False)
class Inputs:
    """The files of a scan that describe its instances."""

    photos: PhotoSet
    views: Sequence[View]
    scale: Scale
    mesh: Mesh
    instances: InstanceTable
    instance_records: InstanceRecords


@dataclass(frozen=True, eq=False)
class _Measured:
    """The shapes of a scan's instances, before any photo is read.

    Parameters
    ----------
    lifted : the instances; shapes : of the instances that have triangles.
    low_confidence : ids of the instances that are probably no holds, with the reason.
    metric : whether lengths are metres.
    """

    views: Sequence[View]
    mesh: Mesh
    lifted: Lifted
    shapes: Mapping[int, Shape]
    low_confidence: Mapping[int, str]
    metric: bool


@dataclass(frozen=True, eq=False)
class _Observations:
    """The content of a scan's photos: the views of each instance by id, and the light."""

    views: Mapping[int, Sequence[HoldView]]
    light: SceneLight


def _measure_instances(reads: Inputs, settings: ClassifySettings) -> _Measured:
    reads.instances.check_fits(reads.mesh)
    lifted = Lifted.of(reads.instances, reads.instance_records)
    # Guessed surface is no evidence of a hold's size, position or colour.
    mesh = reads.mesh.without_guesses()
    lifted = dataclasses.replace(lifted, face_instance=lifted.face_instance[reads.mesh.measured])
    shapes = measure_shapes(mesh, lifted.face_instance, sorted(lifted.kinds))
    low_confidence = low_confidence_reasons(reads.scale, mesh, lifted, shapes, settings)
    return _Measured(reads.views, mesh, lifted, shapes, low_confidence, reads.scale.metric)


def _observe_instances(
    photos: PhotoSet, measured: _Measured, settings: ClassifySettings, progress: Progress
) -> _Observations:
    labels = measured.lifted.face_instance
    views, light = observe(measured.views, photos, measured.mesh, labels, settings, progress)
    known = {number: rows for number, rows in sorted(views.items()) if number in measured.shapes}
    return _Observations(known, with_white(light, known))


def _name_colours(
    measured: _Measured,
    observed: _Observations,
    palette: Sequence[Entry] | None,
    settings: ClassifySettings,
) -> tuple[Sequence[Entry], dict[int, HoldColour], dict[int, HoldColour]]:
    """Return the palette, the colour of each instance that a photo shows, and second colours."""
    scale = {"spread": settings.colour_spread, "lightness_weight": settings.lightness_weight}
    volumes = {number for number, kind in measured.lifted.kinds.items() if kind == "volume"}
    paints, second = split_paints(
        paint_over_views(observed.views, observed.light), observed.views, observed.light, volumes
    )
    if palette:
        entries, colours = palette, assign_colours(paints, palette, **scale)
    else:
        entries, colours = _found_colours(measured, paints, second, volumes, settings)
    return entries, colours, second_colours(second, colours, entries, **scale)


def _found_colours(
    measured: _Measured,
    paints: Mapping[int, HoldPaint],
    second: Mapping[int, HoldPaint],
    volumes: Collection[int],
    settings: ClassifySettings,
) -> tuple[list[Entry], dict[int, HoldColour]]:
    """Return the palette and the colours that the scan's own holds give."""
    sizes = [shape.size for shape in measured.shapes.values()]
    unit = unit_of_sizes(sizes, measured.metric, settings.typical_hold)
    places = {number: shape.position / unit for number, shape in measured.shapes.items()}
    return found_colours(
        paints,
        places,
        volumes,
        measured.low_confidence,
        second,
        upright=measured.metric,
        spread=settings.colour_spread,
        lightness_weight=settings.lightness_weight,
    )


def _with_downclimbs(
    holds: list[Hold], unit: float, settings: ClassifySettings, progress: Progress
) -> list[Hold]:
    """Return the holds with downclimb holds found, unless the palette names some."""
    if settings.downclimb != "auto" or any(hold.role == "downclimb" for hold in holds):
        return holds
    holds, jugs = with_downclimbs(holds, unit)
    if jugs:
        progress.note(f"treated as downclimb holds, of no route: {', '.join(jugs)}")
    return holds


def describe_instances(
    inputs: Inputs, settings: ClassifySettings, cutout_folder: Path, progress: Progress
) -> tuple[Holds, SceneLight, Cutouts, Metrics]:
    """Return colour, type, shape and cutouts of each instance.

    Metrics: holds, volumes, colours, two-coloured holds, holds with a type, holds to review, holds
    that no photo shows, low-confidence instances, cutouts.
    """
    classifier = classifier_of(settings)
    palette = None
    if settings.palette:
        palette = read_palette(Path(settings.palette), settings.lightness_weight)
    measured = _measure_instances(inputs, settings)
    observed = _observe_instances(inputs.photos, measured, settings, progress)
    entries, colours, second = _name_colours(measured, observed, palette, settings)
    names = [view.name for view in measured.views]
    lifted, shapes, reasons = measured.lifted, measured.shapes, measured.low_confidence
    described = describe(lifted, shapes, colours, observed.views, names, entries, settings)
    described = [with_second_colour(hold, second.get(hold.id)) for hold in described]
    confident = [hold for hold in described if hold.id not in reasons]
    unit = unit_of(confident, measured.metric, settings.typical_hold)
    relief = reliefs(measured.mesh, lifted.face_instance, shapes, unit)
    described = with_tints(with_types(described, relief), observed.light, unit)
    if classifier is not None:
        described = list(classifier.holds(described, observed.views))
    holds = [hold for hold in described if hold.id not in reasons]
    if classifier is not None:
        entries = classifier.palette(entries, holds)
    holds = _with_downclimbs(holds, unit, settings, progress)
    rows, cutouts = low_confidence_rows(described, reasons, observed.views)
    for number in observed.views.keys() - cutouts.keys():
        cutouts[number] = best_views(observed.views[number], settings.cutouts)
    progress.step("writing cutouts")
    kept = write_cutouts(cutout_folder, cutouts, names)
    rounded = tuple(hold.rounded() for hold in holds)
    found = Holds(
        palette=tuple(PaletteColour(entry.name, entry.rgb) for entry in entries),
        metric=measured.metric,
        holds=rounded,
        left_out=tuple(rows),
        unit=unit_of(rounded, measured.metric, settings.typical_hold),
        measured_with=MeasuredWith(
            settings.colour_spread, settings.lightness_weight, settings.cutout_px
        ),
    )
    figures = _summary_counts(found, progress) | {"cutouts": len(kept.index)}
    return found, observed.light, kept, figures


def _summary_counts(found: Holds, progress: Progress) -> Metrics:
    """Return the counts for the stage's summary; note the instances that no photo shows."""
    holds = found.holds
    unseen = [hold.id for hold in holds if not hold.photos]
    if unseen:
        progress.note(f"{len(unseen)} instances are visible in no photo: {unseen[:8]}")
    return {
        "holds": sum(hold.kind == "hold" for hold in holds),
        "volumes": sum(hold.kind == "volume" for hold in holds),
        "colours": len(found.palette),
        "two_coloured": sum(bool(hold.second_colour) for hold in holds),
        "typed": sum(hold.kind == "hold" and hold.type != UNKNOWN for hold in holds),
        "review": sum(hold.review for hold in holds),
        "unseen": len(unseen),
        "left_out": len(found.left_out),
    }


def _role_of(kind: str, colour: str, roles: Mapping[str, Role], downclimb: str) -> Role:
    if kind == "volume":
        return "volume"
    if downclimb and colour == downclimb:
        return "downclimb"
    return roles.get(colour, "hold")


def describe(
    lifted: Lifted,
    shapes: Mapping[int, Shape],
    colours: Mapping[int, HoldColour],
    views: Mapping[int, Sequence[HoldView]],
    photos: Sequence[str],
    palette: Sequence[Entry],
    settings: ClassifySettings,
) -> list[Hold]:
    """Return a record of each instance that has triangles, in the order of ids.

    An instance that no photo shows keeps the colour "unknown" and is marked for review.
    """
    roles = {entry.name: entry.role for entry in palette}
    holds: list[Hold] = []
    for number in sorted(shapes):
        shape, kind = shapes[number], lifted.kinds[number]
        colour = colours.get(number, HoldColour(UNKNOWN, (128, 128, 128), 0.0))
        best = best_views(views.get(number, ()), len(photos))
        volume = kind == "volume"
        x, y, z = (float(v) for v in shape.position)
        nx, ny, nz = (float(v) for v in shape.normal)
        holds.append(
            Hold(
                id=number,
                kind=kind,
                position=(x, y, z),
                normal=(nx, ny, nz),
                type="volume" if volume else UNKNOWN,
                type_confidence=1.0 if volume else 0.0,
                colour=colour.name,
                colour_rgb=colour.rgb,
                colour_confidence=colour.confidence,
                size=shape.size,
                area=shape.area,
                steepness_deg=shape.steepness_deg,
                photos=tuple(photos[view.photo] for view in best),
                score=lifted.scores[number],
                role=_role_of(kind, colour.name, roles, settings.downclimb),
                review=colour.confidence < settings.review_below,
            )
        )
    return holds


def with_second_colour(hold: Hold, second: HoldColour | None) -> Hold:
    """Return a hold with its second colour, if it has one."""
    if second is None:
        return hold
    return replace(hold, second_colour=second.name, second_rgb=second.rgb)


def with_types(holds: Sequence[Hold], relief: Mapping[int, Relief]) -> list[Hold]:
    """Return the holds with types named by their relief; volumes keep theirs.

    The type stays "unknown" without a relief, or if the model's confidence is too low
    (`TypeModel`).
    """
    numbers = [hold.id for hold in holds if hold.kind == "hold" and hold.id in relief]
    answers = shipped_model().names_of([relief[number] for number in numbers])
    typed = []
    found = dict(zip(numbers, answers, strict=True))
    for hold in holds:
        name, confidence = found.get(hold.id, (UNKNOWN, 0.0))
        if name != UNKNOWN:
            hold = replace(hold, type=name, type_confidence=confidence)
        typed.append(hold)
    return typed


def with_tints(holds: Sequence[Hold], light: SceneLight, unit: float) -> list[Hold]:
    """Return the holds with the tint of the wall around each, for `routes.link = "paint"`."""
    positions = np.array([hold.position for hold in holds]).reshape(-1, 3)
    tints = light.tint_at(positions, TINT_RADIUS * unit).tolist()
    return [
        replace(hold, wall_tint=(red, green, blue))
        for hold, (red, green, blue) in zip(holds, tints, strict=True)
    ]


# Routes have footholds, small holds and other types; downclimb holds do not. The values were chosen
# on generated gyms by `python -m benchmarks.routes_downclimb choose`.
MIN_HOLDS = 2  # a single jug of a colour is no evidence
MIN_JUGS = 0.25  # minimum share typed as jug; the rest may be of unknown type
MAX_OTHERS = 0.34  # maximum share of the typed holds with another type, for wrong types
MIN_SIZE = 0.8  # minimum median size, as a factor of the wall's median size
MAX_CLUSTER = 4  # a larger group of holds within reach of each other is a route
REACH = 1.6  # metres, along the floor and a fifth of the height
FLATTEN = 0.2


def _largest_cluster(holds: Sequence[Hold], unit: float) -> int:
    """Return the number of holds in the largest group connected by steps of `REACH`."""
    points = np.array([hold.position for hold in holds]) / unit * [1, 1, FLATTEN]
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    return int(np.bincount(components(len(holds), *np.nonzero(apart < REACH))).max())


def downclimb_colours(holds: Sequence[Hold], unit: float) -> list[str]:
    """Return the colours whose holds are large jugs, few and scattered; sorted.

    If types are unknown, no colour has enough jugs and the result is empty.

    Parameters
    ----------
    holds : all holds of a wall, with types.
    unit : scan units per metre.
    """
    climbed = [hold for hold in holds if hold.kind == "hold" and hold.colour != "unknown"]
    sizes = [hold.size for hold in climbed if hold.size > 0]
    if not sizes:
        return []
    median_size = float(np.median(sizes))
    found = []
    for colour in sorted({hold.colour for hold in climbed}):
        own = [hold for hold in climbed if hold.colour == colour]
        types = [hold.type for hold in own]
        jugs, typed = types.count("jug"), len(types) - types.count("unknown")
        if len(own) < MIN_HOLDS or jugs < MIN_JUGS * len(own) or typed - jugs > MAX_OTHERS * typed:
            continue
        large = float(np.median([hold.size for hold in own])) >= MIN_SIZE * median_size
        if large and _largest_cluster(own, unit) <= MAX_CLUSTER:
            found.append(colour)
    return found


def with_downclimbs(holds: Sequence[Hold], unit: float) -> tuple[list[Hold], list[str]]:
    """Return the holds with the role "downclimb" for `downclimb_colours`, and those colours."""
    colours = downclimb_colours(holds, unit)
    changed = [
        replace(hold, role="downclimb") if hold.role == "hold" and hold.colour in colours else hold
        for hold in holds
    ]
    return changed, colours


# Entry points of this group are classes that take `ClassifySettings`; walltopo-lab has one.
ENTRY_POINTS = "walltopo.classifiers"


class Classifier(Protocol):
    """A plug-in that names the holds of a scan."""

    def holds(
        self, holds: Sequence[Hold], views: Mapping[int, Sequence[HoldView]]
    ) -> Sequence[Hold]:
        """Return the holds as the classifier names them; `views` has their cutouts by id."""

    def palette(self, entries: Sequence[Entry], holds: Sequence[Hold]) -> Sequence[Entry]:
        """Return the palette, extended by colours that only the classifier names."""


def classifier_of(settings: ClassifySettings) -> Classifier | None:
    """Return the classifier for `settings.model`, or None if types come from the shape.

    Raises
    ------
    EnvironmentLacksError : no plug-in is installed.
    InputError : the model cannot be used.
    """
    if not settings.model:
        if settings.classes:
            raise SettingsError(
                "classify.classes maps the classes of classify.model, but no model is given"
            )
        return None
    for point in entry_points(group=ENTRY_POINTS):
        found: Classifier = point.load()(settings)
        return found
    raise EnvironmentLacksError(
        "classify.model needs a classifier of cutouts, and none is installed",
        "pip install walltopo-lab",
    )
