"""Join the scan of a part of a wall with its reference: the function of the stage `join`.

The part shows only what the new photos show, in the reference's frame. The result is a scan of the
whole wall: the reference's surface, texture, photos and holds where nothing was photographed, the
new ones elsewhere. It can be the reference of the next rescan.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, StageError
from walltopo.images.files import read_rgb
from walltopo.pipeline.partial.cameras import join_models, photos_still_valid, without_points
from walltopo.pipeline.partial.colours import ColourChoice
from walltopo.pipeline.partial.files import JoinedFiles, ReferenceFiles, WallFiles
from walltopo.pipeline.partial.region import Region, replaced_region, seam_offsets
from walltopo.pipeline.partial.rows import (
    JoinedTables,
    Tables,
    carried_edits,
    join_tables,
    last_id,
    renumbered,
)
from walltopo.pipeline.partial.seam import seam_lines
from walltopo.pipeline.partial.surface import Part, join_meshes, join_textures
from walltopo.scans.artifacts import Context
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.detections import Detections
from walltopo.scans.edits import EditLog, Place
from walltopo.scans.folder import frame_of
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.joined import Joined
from walltopo.scans.manifest import Metrics
from walltopo.scans.people import PEOPLE, PeopleList
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.scans.pictures import (
    INDEX,
    Cutout,
    CutoutIndex,
    Cutouts,
    SceneLight,
    TextureImage,
    TextureUv,
)


def _tables_of_labels(scan: WallFiles, chosen: NDArray[np.int32], log: EditLog | None) -> Tables:
    """Return the tables of a scan, with the instances of the chosen triangles' labels."""
    labels, holds = scan.instances.face_instance, scan.holds_raw
    # An instance without triangles has no place in the mesh, so nothing can replace it.
    nowhere = {h.id for h in (*holds.holds, *holds.left_out)} - set(labels.tolist())
    present = set(np.unique(chosen).tolist()) - {0}
    return Tables(
        frozenset(present | nowhere),
        holds,
        scan.routes_raw,
        scan.instance_records.instances,
        last_id(labels, holds, log),
    )


@dataclass(frozen=True, eq=False)
class _Joint:
    """Both scans, and what stays of each.

    Parameters
    ----------
    kept_photos : names of old photos that stay; photo_of : new photo to its joined name.
    """

    old: ReferenceFiles
    new: WallFiles
    choice: ColourChoice
    region: Region
    kept_photos: tuple[str, ...]
    photo_of: Mapping[str, str]
    tables: JoinedTables = field(repr=False)


def join_with_reference(
    new: WallFiles, old: ReferenceFiles, colours: tuple[str, ...], context: Context
) -> JoinedFiles:
    """Return the artifacts of the whole wall.

    Parameters
    ----------
    new : the rescan; old : its reference, in the same frame.
    colours : only holds of these colours are exchanged; empty: all holds.

    Raises
    ------
    InputError : the scans are in different frames.
    StageError : the photos show nothing of the reference's wall.
    """
    if frame_of(new.scale, new.sparse) != frame_of(old.scale, old.sparse):
        raise InputError(
            f"{old.sparse.folder.parent}: was measured anew since the photos were aligned to it",
            "Scan the new photos again.",
        )
    progress, scratch = context.progress, context.scratch
    progress.step("join with the rest of the wall", 3)
    choice = ColourChoice.of(colours, old.holds_raw, old.holds, new.holds_raw)
    joint = _join_tables(old, new, choice)
    progress.advance()
    parts = (
        Part(old.mesh, joint.region.old, old.texture_uv.uv, read_rgb(old.texture.path)),
        Part(new.mesh, joint.region.new, new.texture_uv.uv, read_rgb(new.texture.path)),
    )
    mesh = join_meshes(parts)
    image, uv = join_textures(parts)
    picture = scratch / "texture.png"
    cv2.imwrite(str(picture), image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    progress.advance()
    tables, joined = joint.tables, _join_summary(joint, colours)
    records = InstanceRecords(
        classes=old.instance_records.classes | new.instance_records.classes,
        instances=tables.records,
    )
    files = JoinedFiles(
        photos=_joined_photos(joint, scratch),
        photo_list=_joined_photo_list(joint),
        sparse=_joined_sparse(joint, scratch),
        scale=new.scale,
        mesh=mesh,
        texture=TextureImage(picture),
        texture_uv=TextureUv(uv),
        detections=_joined_detections(joint),
        instances=_joined_instances(joint),
        instance_records=records,
        holds_raw=tables.holds,
        light=_joined_light(joint),
        cutouts=_joined_cutouts(joint, scratch),
        routes_raw=tables.routes,
        joined=joined,
        carried=_carried_edits(joint),
        metrics=_metrics(joined, mesh, tables.holds),
    )
    progress.advance()
    return files


def _metrics(joined: Joined, mesh: Mesh, holds: Holds) -> Metrics:
    return {
        "summary": joined.summary,
        "faces": len(mesh.faces),
        "area": round(float(mesh.areas[mesh.measured].sum()), 3),
        "holds": sum(hold.kind == "hold" for hold in holds.holds),
        "volumes": sum(hold.kind == "volume" for hold in holds.holds),
    }


def _join_tables(old: ReferenceFiles, new: WallFiles, choice: ColourChoice) -> _Joint:
    """Decide what stays, and join the tables."""
    old.instances.check_fits(old.mesh)
    new.instances.check_fits(new.mesh)
    region = replaced_region(
        old.mesh,
        old.instances.face_instance,
        new.mesh,
        new.instances.face_instance,
        new.sparse.views,
        old.holds_raw.unit,
        choice.exchange,
    )
    if not region.new.any():
        raise StageError(
            "the new photos replace nothing of the wall: no part of it is in two of them",
            "Photograph the changed part from at least two places, with what is around it.",
        )
    views = old.sparse.views
    kept = set(photos_still_valid(old.mesh, region.old, views))
    staying = set(np.unique(old.instances.face_instance[region.old]).tolist())
    # The best photos of a hold are needed to measure it again after an edit.
    for hold in old.holds_raw.holds:
        kept |= set(hold.photos[:3]) if hold.id in staying else set()
    kept_photos = tuple(view.name for view in views if view.name in kept)
    photo_of = _new_names([view.name for view in new.sparse.views], kept_photos)
    stays, added = old.instances.face_instance[region.old], region.new_labels[region.new]
    tables = join_tables(
        _tables_of_labels(old, stays, old.log), _tables_of_labels(new, added, None), photo_of, kept
    )
    return _Joint(old, new, choice, region, kept_photos, photo_of, tables)


def _new_names(names: Collection[str], taken: Collection[str]) -> dict[str, str]:
    """Return the joined name of each new photo: its own, with a number in front if it is taken."""
    used, found = set(taken), {}
    for name in sorted(names):
        path, number, joined = Path(name), 2, name
        while joined in used:
            joined = str(path.with_name(f"{number}-{path.name}"))
            number += 1
        used.add(joined)
        found[name] = joined
    return found


def _joined_sparse(joint: _Joint, scratch: Path) -> SparseModel:
    model = joint.old.sparse.open()
    without_points(model, joint.old.mesh, joint.region.old)
    joined = join_models(model, joint.new.sparse.open(), joint.kept_photos, joint.photo_of)
    made = scratch / "sparse"
    made.mkdir()
    joined.write(made)
    return SparseModel(made)


def _joined_photos(joint: _Joint, scratch: Path) -> PhotoSet:
    made = scratch / "photos"
    for source, names in (
        (joint.old.photos, {name: name for name in joint.kept_photos}),
        (joint.new.photos, joint.photo_of),
    ):
        for name, joined in names.items():
            target = made / joined
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source.path(name), target)
    people = _joined_people(joint)
    if people.photos:
        people.save(made / PEOPLE)
    return PhotoSet(made)


def _joined_people(joint: _Joint) -> PeopleList:
    old, new = joint.old.photos.people.photos, joint.new.photos.people.photos
    rows = [entry for entry in old if entry.photo in joint.kept_photos]
    rows += [
        replace(entry, photo=joint.photo_of[entry.photo])
        for entry in new
        if entry.photo in joint.photo_of
    ]
    return PeopleList(photos=tuple(rows))


def _joined_photo_list(joint: _Joint) -> PhotoList:
    kept, old, new = set(joint.kept_photos), joint.old.photo_list, joint.new.photo_list
    rows = [photo for photo in old.photos if photo.name in kept]
    rows += [
        replace(photo, name=joint.photo_of[photo.name])
        for photo in new.photos
        if photo.name in joint.photo_of
    ]
    return PhotoList(photos=tuple(rows), skipped=new.skipped)


def _joined_detections(joint: _Joint) -> Detections:
    old, new, photo_of = joint.old.detections, joint.new.detections, joint.photo_of
    kept = [name for name in joint.kept_photos if name in old.sizes]
    fresh = [name for name in photo_of if name in new.sizes]
    return Detections(
        {name: old.masks.get(name, ()) for name in kept}
        | {photo_of[name]: new.masks.get(name, ()) for name in fresh},
        {name: old.sizes[name] for name in kept} | {photo_of[n]: new.sizes[n] for n in fresh},
        dict(old.classes) | dict(new.classes),
        new.description,
    )


def _joined_instances(joint: _Joint) -> InstanceTable:
    old, new, region = joint.old.instances, joint.new.instances, joint.region
    labels = renumbered(region.new_labels, joint.tables.number_of)
    return InstanceTable(
        np.concatenate([old.face_instance[region.old], labels[region.new]]),
        np.concatenate([old.face_score[region.old], new.face_score[region.new]]),
    )


def _joined_light(joint: _Joint) -> SceneLight:
    """Return the light: each photo's gain, and the patches of the surface that each scan gives."""
    from scipy.spatial import cKDTree

    def chosen(light: SceneLight, mesh: Mesh, flags: NDArray[np.bool_]) -> NDArray[np.bool_]:
        if not len(light.points):
            return np.zeros(0, dtype=np.bool_)
        return np.asarray(flags[cKDTree(mesh.centroids).query(light.points)[1]])

    old, new = joint.old, joint.new
    gains = {
        name: gain
        for view, gain in zip(old.sparse.views, old.light.gain, strict=True)
        if (name := view.name) in joint.kept_photos
    } | {
        joint.photo_of[view.name]: gain
        for view, gain in zip(new.sparse.views, new.light.gain, strict=True)
    }
    first = chosen(old.light, old.mesh, joint.region.old)
    second = chosen(new.light, new.mesh, joint.region.new)
    return SceneLight(
        gain=np.array([gains[name] for name in sorted(gains)]).reshape(-1, 3),
        points=np.vstack([old.light.points[first], new.light.points[second]]),
        colour=np.vstack([old.light.colour[first], new.light.colour[second]]),
        wall=old.light.wall,
        white=old.light.white,
    )


def _joined_cutouts(joint: _Joint, scratch: Path) -> Cutouts:
    made = scratch / "cutouts"
    made.mkdir()
    number_of, present = joint.tables.number_of, _present(joint.tables.holds)
    rows: list[Cutout] = []
    for entry in joint.new.cutouts.index:
        if entry.id in number_of and entry.photo in joint.photo_of:
            file = f"{number_of[entry.id]:05d}-new-{Path(entry.file).name}"
            shutil.copyfile(joint.new.cutouts.folder / entry.file, made / file)
            photo = joint.photo_of[entry.photo]
            rows.append(replace(entry, id=number_of[entry.id], file=file, photo=photo))
    renewed = {row.id for row in rows}
    for entry in joint.old.cutouts.index:
        if entry.id in present - renewed and entry.photo in joint.kept_photos:
            target = made / entry.file
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(joint.old.cutouts.folder / entry.file, target)
            rows.append(entry)
    rows.sort(key=lambda row: row.id)  # stable: the best picture of each stays first
    index = CutoutIndex(cutouts=tuple(rows))
    index.save(made / INDEX)
    return Cutouts(made, index.cutouts)


def _present(holds: Holds) -> set[int]:
    return {hold.id for hold in (*holds.holds, *holds.left_out)}


def _carried_edits(joint: _Joint) -> EditLog | None:
    log = joint.old.log
    if not log.edits:
        return None
    from scipy.spatial import cKDTree

    tree = cKDTree(joint.old.mesh.centroids)

    def is_replaced(place: Place) -> bool:
        _, nearest = tree.query(np.array(place))
        return not bool(joint.region.old[nearest])

    return carried_edits(log, joint.tables.gone, is_replaced)


def _join_summary(joint: _Joint, colours: tuple[str, ...]) -> Joined:
    """Return what the join did, for the manifest and the review."""
    old, new, region, tables = joint.old, joint.new, joint.region, joint.tables
    labels = old.instances.face_instance
    offsets = seam_offsets(old.mesh, labels, new.mesh, region, old.holds_raw.unit)
    photographed = tables.added | tables.same
    return Joined(
        replaced_share=round(float(old.mesh.areas[~region.old].sum() / old.mesh.areas.sum()), 4),
        seam_mm=round(1000 * float(np.percentile(offsets, 95)) / old.holds_raw.unit, 2)
        if len(offsets)
        else None,
        photos_kept=len(joint.kept_photos),
        photos_new=len(joint.photo_of),
        stays=tuple(sorted({h.id for h in tables.holds.holds} - photographed)),
        same=tuple(sorted(tables.same)),
        gone=tuple(sorted(tables.gone)),
        added=tuple(sorted(tables.added)),
        seam=tuple(
            tuple((round(x, 4), round(y, 4), round(z, 4)) for x, y, z in line.tolist())
            for line in seam_lines(old.mesh, region.old, old.holds_raw.unit)
        ),
        colours=colours,
        missing=tuple(joint.choice.missing(region, old.holds_raw)),
        ignored=joint.choice.ignored(region, new.holds_raw) if colours else 0,
    )
