"""The `classify` stage: colour, type, shape and cutouts of each instance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, View
from walltopo.routes.admit import (
    admitted,
    doubtful,
    is_metric,
    left_out_rows,
    on_plates,
    read_instances,
)
from walltopo.routes.colour import Coloured, Look, assign_colours, find_palette, paint_over_views
from walltopo.routes.cutouts import best_views, write_cutouts
from walltopo.routes.downclimb import with_downclimbs
from walltopo.routes.edits import apply_hold_edits
from walltopo.routes.geometry import Shape, measure_shapes
from walltopo.routes.hold_type import shipped_model
from walltopo.routes.light import SceneLight, solve_light
from walltopo.routes.likeness import TINT_RADIUS
from walltopo.routes.palette import Entry, read_palette
from walltopo.routes.params import ClassifySettings
from walltopo.routes.records import Hold, StartTag
from walltopo.routes.relief import Relief, reliefs
from walltopo.routes.samples import HoldView, Picture, load_photo, look, wall_patches
from walltopo.routes.tag_looks import CardSizes
from walltopo.routes.tags import FoundTag, TagFinder, band_looks, record_of
from walltopo.routes.units import unit_of, unit_of_sizes
from walltopo.routes.verdicts import classifier_of, followed, with_class_colours
from walltopo.workspace import ScanFolder, write_json

__all__ = ["gather", "run", "with_types"]

Floats = NDArray[np.float64]
UNKNOWN = "unknown"
PATCHES = 60  # wall patches along the longest side of the wall


def gather(
    views: Sequence[View],
    photos: Path,
    mesh: Mesh,
    face_instance: NDArray[np.int32],
    settings: ClassifySettings,
    progress: Progress,
    also: Callable[[Picture], None] | None = None,
) -> tuple[dict[int, list[HoldView]], SceneLight]:
    """What all photos show of each hold, and the light they were taken in.

    `also` is called with each photo while it is in memory.
    """
    progress.step("reading holds in photos", len(views))
    seen: dict[int, list[HoldView]] = {}
    lights = []

    def load(view: View, width: int, height: int) -> NDArray[np.uint8]:
        return load_photo(photos / view.name, width, height)

    stream = look(
        views,
        load,
        mesh,
        face_instance,
        long_side=settings.long_side,
        erode=settings.erode,
        crop_px=settings.cutout_px,
        also=also,
    )
    for holds, light in stream:
        for hold in holds:
            seen.setdefault(hold.hold, []).append(hold)
        lights.append(light)
        progress.advance()
    centres, size = _patch_centres(mesh, face_instance)
    return seen, solve_light(lights, len(views), centres, size)


def _patch_centres(mesh: Mesh, face_instance: NDArray[np.int32]) -> tuple[Floats, float]:
    patch = wall_patches(mesh, face_instance, PATCHES)
    rows = patch >= 0
    count = int(patch.max(initial=-1)) + 1
    total = np.maximum(np.bincount(patch[rows], minlength=count), 1)
    sums = [np.bincount(patch[rows], mesh.centroids[rows, k], count) for k in range(3)]
    size = float(np.ptp(mesh.vertices, axis=0).max()) / PATCHES
    return np.stack(sums, axis=1) / total[:, None], size


def _role(kind: str, colour: str, roles: Mapping[str, str], downclimb: str) -> str:
    if kind == "volume":
        return "volume"
    if downclimb and colour == downclimb:
        return "downclimb"
    return roles.get(colour, "hold")


def describe(
    kinds: Mapping[int, str],
    shapes: Mapping[int, Shape],
    colours: Mapping[int, Coloured],
    seen: Mapping[int, Sequence[HoldView]],
    photos: Sequence[str],
    palette: Sequence[Entry],
    settings: ClassifySettings,
) -> list[Hold]:
    """Put together what is known of each instance that has triangles, in the order of ids.

    An instance that no photo shows keeps the colour "unknown" and is marked for review.
    """
    roles = {entry.name: entry.role for entry in palette}
    holds: list[Hold] = []
    for number in sorted(shapes):
        shape, kind = shapes[number], kinds[number]
        colour = colours.get(number, Coloured(UNKNOWN, (128, 128, 128), 0.0))
        best = best_views(seen.get(number, ()), len(photos))
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
                size_m=shape.size_m,
                area_m2=shape.area_m2,
                steepness_deg=shape.steepness_deg,
                photos=tuple(photos[view.photo] for view in best),
                role=_role(kind, colour.name, roles, settings.downclimb),
                review=colour.confidence < settings.review_below,
            )
        )
    return holds


def with_types(holds: Sequence[Hold], looks: Mapping[int, Relief]) -> list[Hold]:
    """Name the type of each hold by its relief; volumes keep theirs.

    The type stays "unknown" where there is no relief or the model is not sure
    (`hold_type.TypeModel`).
    """
    asked = [hold.id for hold in holds if hold.kind == "hold" and hold.id in looks]
    answers = shipped_model().names_of([looks[number] for number in asked])
    typed = []
    found = dict(zip(asked, answers, strict=True))
    for hold in holds:
        name, sure = found.get(hold.id, (UNKNOWN, 0.0))
        if name != UNKNOWN:
            hold = replace(hold, type=name, type_confidence=sure)
        typed.append(hold)
    return typed


def with_tints(holds: Sequence[Hold], light: SceneLight, unit: float) -> list[Hold]:
    """Note the tint of the wall around each hold, for `routes.link = "paint"`."""
    positions = np.array([hold.position for hold in holds]).reshape(-1, 3)
    tints = light.tint_at(positions, TINT_RADIUS * unit).tolist()
    return [
        replace(hold, wall_tint=(red, green, blue))
        for hold, (red, green, blue) in zip(holds, tints, strict=True)
    ]


def _painted(
    mesh: Mesh,
    face_instance: NDArray[np.int32],
    kinds: Mapping[int, str],
    strokes: list[dict[str, Any]],
    progress: Progress,
) -> NDArray[np.int32]:
    """The labels after a setter's strokes; strokes of holds that are gone are left out."""
    from walltopo.formats.edits import apply_strokes

    known = [stroke for stroke in strokes if stroke["hold"] == 0 or stroke["hold"] in kinds]
    if len(known) < len(strokes):
        progress.note(f"{len(strokes) - len(known)} strokes paint holds that are not there")
    return apply_strokes(mesh, face_instance, known)


def _tag_finder(
    scan: ScanFolder,
    mesh: Mesh,
    shapes: Mapping[int, Shape],
    kinds: Mapping[int, str],
    settings: ClassifySettings,
) -> TagFinder:
    """Looks for cards of the right size; the holds are the ruler of a scan without a scale."""
    sizes = [shape.size_m for number, shape in shapes.items() if kinds[number] == "hold"]
    unit = unit_of_sizes(sizes, is_metric(scan), settings.typical_hold)
    return TagFinder(mesh, CardSizes.of(settings, unit))


def _tags(finder: TagFinder, scan: ScanFolder, settings: ClassifySettings) -> dict[int, FoundTag]:
    """The tags that were found, numbered from 1; none of them on a printed plate."""
    found = dict(enumerate(finder.tags(settings.tag_confidence)))
    plated = on_plates({number: tag.position for number, tag in found.items()}, scan)
    return dict(enumerate((found[k] for k in found.keys() - plated), start=1))


def run(scan: ScanFolder, settings: ClassifySettings, progress: Progress) -> dict[str, Any]:
    """Read photos, `sparse/`, `mesh.ply` and the instances; write `attributes.json`, `cutouts/`.

    Returns
    -------
    Metrics: holds, volumes, colours, holds with a type, holds to review, holds that no photo
    shows, instances left out as doubtful, start tags, cutouts.
    """
    from walltopo.formats.colmap import read_views
    from walltopo.formats.edits import read_hold_edits
    from walltopo.formats.ply import read_mesh

    classifier = classifier_of(settings)
    palette = None
    if settings.palette:
        palette = read_palette(Path(settings.palette), settings.lightness_weight)
    mesh = read_mesh(scan.mesh)
    lifted = read_instances(scan, len(mesh.faces))
    kinds = lifted.kinds
    edits = read_hold_edits(scan.hold_edits)
    face_instance = _painted(mesh, lifted.face_instance, kinds, edits["strokes"], progress)
    views = read_views(scan.sparse)
    shapes = measure_shapes(mesh, face_instance, sorted(kinds))
    painted = replace(lifted, face_instance=face_instance)
    doubts = doubtful(scan, mesh, painted, shapes, settings)
    trusted = {number: shape for number, shape in shapes.items() if number not in doubts}
    finder = _tag_finder(scan, mesh, trusted, kinds, settings)
    also = finder.read if settings.start_tags else None
    seen, light = gather(views, scan.photos, mesh, face_instance, settings, progress, also)
    tags = _tags(finder, scan, settings)
    doubts |= {tag.instance: "is a start tag" for tag in tags.values() if tag.instance}
    seen = {number: rows for number, rows in sorted(seen.items()) if number in shapes}
    bands = {-k: band_looks(tag) for k, tag in tags.items() if band_looks(tag)}
    places = {number: shape.position for number, shape in shapes.items()}
    places |= {-k: tag.position for k, tag in tags.items()}
    shown: dict[int, Sequence[Look]] = {**seen, **bands}
    paints = paint_over_views(shown, light, places, settings.max_views, seen.keys())
    scale = {"spread": settings.colour_spread, "lightness_weight": settings.lightness_weight}
    volumes = {number for number, kind in kinds.items() if kind == "volume"}
    sure = {number: paints[number] for number in seen if number not in doubts}
    entries = palette or find_palette(sure, volumes, **scale)
    colours = assign_colours(paints, entries, **scale)
    names = [view.name for view in views]
    described = describe(kinds, shapes, colours, seen, names, entries, settings)
    sizable = [hold for hold in described if hold.id not in doubts]
    unit = unit_of(sizable, is_metric(scan), settings.typical_hold)
    holds, left_out = admitted(described, doubts, edits["holds"], unit)
    holds = with_types(holds, reliefs(mesh, face_instance, shapes, unit))
    holds = with_tints(holds, light, unit)
    if classifier is not None:
        holds = followed(holds, seen, classifier, settings)
        entries = with_class_colours(entries, holds)
    if settings.downclimb == "auto" and not any(hold.role == "downclimb" for hold in holds):
        holds, jugs = with_downclimbs(holds, unit)
        if jugs:
            progress.note(f"taken for downclimb holds, of no route: {', '.join(jugs)}")
    holds, lost = apply_hold_edits(holds, edits["holds"], unit)
    for line in lost:
        progress.note(f"{scan.hold_edits.name}: {line}")
    rows, cutouts = left_out_rows(left_out, lifted.scores, doubts, seen)
    for number in seen.keys() - cutouts.keys():
        cutouts[number] = best_views(seen[number], settings.cutouts)
    progress.step("writing cutouts")
    write_cutouts(scan.cutouts, cutouts, names)
    named = {-number: paint.name for number, paint in colours.items() if paint.name != UNKNOWN}
    records = [record_of(k, tag, named.get(k, ""), names) for k, tag in tags.items()]
    metrics = _written(scan, entries, holds, records, rows, progress)
    return metrics | {"cutouts": sum(len(kept) for kept in cutouts.values())}


def _written(
    scan: ScanFolder,
    palette: Sequence[Entry],
    holds: Sequence[Hold],
    tags: Sequence[StartTag],
    left_out: Sequence[Mapping[str, Any]],
    progress: Progress,
) -> dict[str, Any]:
    """Write `attributes.json`; what there is to count."""
    unseen = [hold.id for hold in holds if not hold.photos]
    if unseen:
        progress.note(f"{len(unseen)} instances are seen in no photo: {unseen[:8]}")
    write_json(
        scan.attributes,
        {
            "version": 1,
            "palette": [{"name": entry.name, "rgb": list(entry.rgb)} for entry in palette],
            "instances": [hold.to_json() for hold in holds],
            "tags": [tag.to_json() for tag in tags],
            "left_out": left_out,
        },
    )
    return {
        "holds": sum(hold.kind == "hold" for hold in holds),
        "volumes": sum(hold.kind == "volume" for hold in holds),
        "colours": len(palette),
        "typed": sum(hold.kind == "hold" and hold.type != UNKNOWN for hold in holds),
        "review": sum(hold.review for hold in holds),
        "unseen": len(unseen),
        "left_out": len(left_out),
        "tags": len(tags),
    }
