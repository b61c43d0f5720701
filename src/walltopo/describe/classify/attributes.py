"""Colour, type, shape and cutouts of each instance, from the scan's files and photos."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from walltopo.core import Mesh, Progress, View
from walltopo.describe.classify.colour import (
    Coloured,
    assign_colours,
    find_palette,
    paint_over_views,
    with_white,
)
from walltopo.describe.classify.cutouts import best_views, write_cutouts
from walltopo.describe.classify.describe import describe, with_tints, with_types
from walltopo.describe.classify.downclimb import with_downclimbs
from walltopo.describe.classify.geometry import Shape, measure_shapes
from walltopo.describe.classify.low_confidence import Lifted, doubtful, left_out
from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.observe import observe
from walltopo.describe.classify.palette import Entry, read_palette
from walltopo.describe.classify.plug_in import classifier_of
from walltopo.describe.classify.settings import ClassifySettings
from walltopo.describe.classify.types import reliefs
from walltopo.scans.attributes import UNKNOWN, Hold, MeasuredWith, PaletteColour, RawAttributes
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.light import SceneLight
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import Cutouts
from walltopo.scans.scale import Scale, unit_of


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
class _Wall:
    """What the files of a scan say before a photo is read.

    Parameters
    ----------
    lifted : the instances; shapes : of those that have triangles.
    doubts : ids of the instances that are no holds, and why.
    metric : whether lengths are metres.
    """

    views: Sequence[View]
    mesh: Mesh
    lifted: Lifted
    shapes: Mapping[int, Shape]
    doubts: Mapping[int, str]
    metric: bool


@dataclass(frozen=True, eq=False)
class _Looks:
    """What the photos of a scan show: instances by id, and the light."""

    seen: Mapping[int, Sequence[HoldView]]
    light: SceneLight


def _read_wall(reads: Inputs, settings: ClassifySettings) -> _Wall:
    reads.instances.check_fits(reads.mesh)
    lifted = Lifted.of(reads.instances, reads.instance_records)
    # What is guessed says nothing of a hold's size, place and colour.
    mesh = reads.mesh.without_guesses()
    lifted = replace(lifted, face_instance=lifted.face_instance[reads.mesh.measured])
    shapes = measure_shapes(mesh, lifted.face_instance, sorted(lifted.kinds))
    doubts = doubtful(reads.scale, mesh, lifted, shapes, settings)
    return _Wall(reads.views, mesh, lifted, shapes, doubts, reads.scale.metric)


def _read_photos(
    photos: PhotoSet, wall: _Wall, settings: ClassifySettings, progress: Progress
) -> _Looks:
    labels = wall.lifted.face_instance
    seen, light = observe(wall.views, photos, wall.mesh, labels, settings, progress)
    known = {number: rows for number, rows in sorted(seen.items()) if number in wall.shapes}
    places = {number: shape.position for number, shape in wall.shapes.items()}
    return _Looks(known, with_white(light, known, places))


def _colours(
    wall: _Wall,
    looks: _Looks,
    palette: Sequence[Entry] | None,
    settings: ClassifySettings,
) -> tuple[Sequence[Entry], dict[int, Coloured]]:
    """The palette, and the colour of each instance that a photo shows."""
    places = {number: shape.position for number, shape in wall.shapes.items()}
    paints = paint_over_views(looks.seen, looks.light, places)
    scale = {"spread": settings.colour_spread, "lightness_weight": settings.lightness_weight}
    volumes = {number for number, kind in wall.lifted.kinds.items() if kind == "volume"}
    sure = {number: paints[number] for number in looks.seen if number not in wall.doubts}
    entries = palette or find_palette(sure, volumes, **scale)
    return entries, assign_colours(paints, entries, **scale)


def _with_downclimbs(
    holds: list[Hold], unit: float, settings: ClassifySettings, progress: Progress
) -> list[Hold]:
    """With downclimb holds, where nobody named any."""
    if settings.downclimb != "auto" or any(hold.role == "downclimb" for hold in holds):
        return holds
    holds, jugs = with_downclimbs(holds, unit)
    if jugs:
        progress.note(f"taken for downclimb holds, of no route: {', '.join(jugs)}")
    return holds


def describe_instances(
    inputs: Inputs, settings: ClassifySettings, cutout_folder: Path, progress: Progress
) -> tuple[RawAttributes, SceneLight, Cutouts, Metrics]:
    """Colour, type, shape and cutouts of each instance.

    Metrics: holds, volumes, colours, holds with a type, holds to review, holds that no photo
    shows, instances left out as doubtful, cutouts.
    """
    classifier = classifier_of(settings)
    palette = None
    if settings.palette:
        palette = read_palette(Path(settings.palette), settings.lightness_weight)
    wall = _read_wall(inputs, settings)
    looks = _read_photos(inputs.photos, wall, settings, progress)
    entries, colours = _colours(wall, looks, palette, settings)
    kinds, names = wall.lifted.kinds, [view.name for view in wall.views]
    described = describe(kinds, wall.shapes, colours, looks.seen, names, entries, settings)
    sure = [hold for hold in described if hold.id not in wall.doubts]
    unit = unit_of(sure, wall.metric, settings.typical_hold)
    relief = reliefs(wall.mesh, wall.lifted.face_instance, wall.shapes, unit)
    described = with_tints(with_types(described, relief), looks.light, unit)
    if classifier is not None:
        described = list(classifier.holds(described, looks.seen))
    holds = [hold for hold in described if hold.id not in wall.doubts]
    if classifier is not None:
        entries = classifier.palette(entries, holds)
    holds = _with_downclimbs(holds, unit, settings, progress)
    rows, cutouts = left_out(described, wall.lifted.scores, wall.doubts, looks.seen)
    for number in looks.seen.keys() - cutouts.keys():
        cutouts[number] = best_views(looks.seen[number], settings.cutouts)
    progress.step("writing cutouts")
    kept = write_cutouts(cutout_folder, cutouts, names)
    rounded = tuple(hold.rounded() for hold in holds)
    attributes = RawAttributes(
        palette=tuple(PaletteColour(entry.name, entry.rgb) for entry in entries),
        instances=rounded,
        left_out=tuple(rows),
        unit=unit_of(rounded, wall.metric, settings.typical_hold),
        measured_with=MeasuredWith(
            settings.colour_spread, settings.lightness_weight, settings.cutout_px
        ),
    )
    figures = _figures(attributes, progress) | {"cutouts": len(kept.index)}
    return attributes, looks.light, kept, figures


def _figures(attributes: RawAttributes, progress: Progress) -> Metrics:
    """What there is to count."""
    holds = attributes.instances
    unseen = [hold.id for hold in holds if not hold.photos]
    if unseen:
        progress.note(f"{len(unseen)} instances are seen in no photo: {unseen[:8]}")
    return {
        "holds": sum(hold.kind == "hold" for hold in holds),
        "volumes": sum(hold.kind == "volume" for hold in holds),
        "colours": len(attributes.palette),
        "typed": sum(hold.kind == "hold" and hold.type != UNKNOWN for hold in holds),
        "review": sum(hold.review for hold in holds),
        "unseen": len(unseen),
        "left_out": len(attributes.left_out),
    }
