"""Join a finished partial rescan with its reference, in the rescan's own folder.

Until here the scan shows only what the new photos show, in the reference's frame. Afterwards the
folder is a scan of the whole wall: the reference's surface, texture, photos and holds where nothing
was photographed, the new ones elsewhere. It needs the reference no more, and can be the reference
of the next rescan. The reference's folder is never modified.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, Progress, StageError
from walltopo.images.files import read_rgb
from walltopo.pipeline.partial.cameras import join_models, photos_that_stay, without_points
from walltopo.pipeline.partial.colours import ColourChoice
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
from walltopo.scans.artifacts import load_bundle, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.detections import Detections
from walltopo.scans.edits import EditLog, Place
from walltopo.scans.folder import ScanFolder, world_frame
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.manifest import Joined, Metrics
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
from walltopo.scans.routes import Routes


@dataclass(frozen=True, eq=False)
class _Scan:
    """The artifacts of one scan before any edit."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    sparse: SparseModel = of(ScanFolder.sparse)
    mesh: Mesh = of(ScanFolder.mesh)
    texture: TextureImage = of(ScanFolder.texture)
    texture_uv: TextureUv = of(ScanFolder.texture_uv)
    detections: Detections = of(ScanFolder.detections)
    instances: InstanceTable = of(ScanFolder.instances)
    records: InstanceRecords = of(ScanFolder.instance_records)
    holds: Holds = of(ScanFolder.holds_raw)
    light: SceneLight = of(ScanFolder.light)
    cutouts: Cutouts = of(ScanFolder.cutouts)
    routes: Routes = of(ScanFolder.routes_raw)
    edits: EditLog | None = of(ScanFolder.edits)

    def tables(self, chosen: NDArray[np.int32]) -> Tables:
        """Return the tables, with the instances of the chosen triangles' labels."""
        labels = self.instances.face_instance
        # An instance without triangles has no place in the mesh, so nothing can replace it.
        nowhere = {h.id for h in (*self.holds.holds, *self.holds.left_out)} - set(labels.tolist())
        present = set(np.unique(chosen).tolist()) - {0}
        return Tables(
            frozenset(present | nowhere),
            self.holds,
            self.routes,
            self.records.instances,
            last_id(labels, self.holds, self.edits),
        )


@dataclass(frozen=True, eq=False)
class _Joint:
    """Both scans, and what stays of each.

    Parameters
    ----------
    kept_photos : names of old photos that stay; photo_of : new photo to its joined name.
    """

    old: _Scan
    new: _Scan
    choice: ColourChoice
    region: Region
    kept_photos: tuple[str, ...]
    photo_of: Mapping[str, str]
    tables: JoinedTables = field(repr=False)


def join_with_reference(
    folder: ScanFolder,
    reference: ScanFolder,
    scratch: Path,
    progress: Progress,
    colours: tuple[str, ...] = (),
) -> tuple[Joined, dict[str, Metrics]]:
    """Replace the artifacts of a partial rescan by those of the whole wall.

    Returns
    -------
    What was replaced, and by stage the metrics that the join changes.

    Parameters
    ----------
    folder : the rescan, finished up to `routes`; reference : a finished scan in the same frame.
    scratch : an empty folder on the disk of the rescan.
    colours : only holds of these colours are exchanged; empty: all holds.

    Raises
    ------
    InputError : a file is missing, or the scans are in different frames.
    StageError : the photos show nothing of the reference's wall.
    """
    if world_frame(folder) != world_frame(reference):
        raise InputError(
            f"{reference.root}: was measured anew since the photos were aligned to it",
            "Scan the new photos again.",
        )
    progress.step("join with the rest of the wall", 4)
    old, new = load_bundle(reference, _Scan), load_bundle(folder, _Scan)
    shown = Holds.load(reference.holds)
    joint = _joint(old, new, ColourChoice.of(colours, old.holds, shown, new.holds))
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
    sparse, photos = _joined_sparse(joint, scratch), _joined_photos(joint, scratch)
    cutouts, joined = _joined_cutouts(joint, scratch), _figures(joint, colours)
    progress.advance()
    tables, store = joint.tables, _storer(folder)
    store("photos", photos)
    store("photo_list", _joined_photo_list(joint))
    store("sparse", sparse)
    store("mesh", mesh)
    store("texture", TextureImage(picture))
    store("texture_uv", TextureUv(uv))
    store("detections", _joined_detections(joint))
    store("instances", _joined_instances(joint))
    store(
        "instance_records",
        InstanceRecords(
            classes=old.records.classes | new.records.classes, instances=tables.records
        ),
    )
    store("holds_raw", tables.holds)
    store("light", _joined_light(joint))
    store("cutouts", cutouts)
    store("routes_raw", tables.routes)
    store("edits", _joined_edits(joint))
    progress.advance()
    return joined, _metrics(mesh, tables.holds)


def _metrics(mesh: Mesh, holds: Holds) -> dict[str, Metrics]:
    """Return by stage the metrics that the join changes."""
    area = round(float(mesh.areas[mesh.measured].sum()), 3)
    return {
        "dense": {"faces": len(mesh.faces), "area": area},
        "classify": {
            "holds": sum(hold.kind == "hold" for hold in holds.holds),
            "volumes": sum(hold.kind == "volume" for hold in holds.holds),
        },
    }


def _storer(folder: ScanFolder) -> Callable[[str, object], None]:
    def store(name: str, value: object) -> None:
        getattr(ScanFolder, name).store(folder, value)

    return store


def _joint(old: _Scan, new: _Scan, choice: ColourChoice) -> _Joint:
    """Decide what stays, and join the tables."""
    old.instances.check_fits(old.mesh)
    new.instances.check_fits(new.mesh)
    region = replaced_region(
        old.mesh,
        old.instances.face_instance,
        new.mesh,
        new.instances.face_instance,
        new.sparse.views,
        old.holds.unit,
        choice.exchange,
    )
    if not region.new.any():
        raise StageError(
            "the new photos replace nothing of the wall: no part of it is in two of them",
            "Photograph the changed part from at least two places, with what is around it.",
        )
    views = old.sparse.views
    kept = set(photos_that_stay(old.mesh, region.old, views))
    staying = set(np.unique(old.instances.face_instance[region.old]).tolist())
    # The best photos of a hold are needed to measure it again after an edit.
    for hold in old.holds.holds:
        kept |= set(hold.photos[:3]) if hold.id in staying else set()
    kept_photos = tuple(view.name for view in views if view.name in kept)
    photo_of = _new_names([view.name for view in new.sparse.views], kept_photos)
    stays, added = old.instances.face_instance[region.old], region.new_labels[region.new]
    tables = join_tables(old.tables(stays), new.tables(added), photo_of, kept)
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


def _joined_edits(joint: _Joint) -> EditLog | None:
    log = joint.old.edits
    if log is None:
        return None
    from scipy.spatial import cKDTree

    tree = cKDTree(joint.old.mesh.centroids)

    def is_replaced(place: Place) -> bool:
        _, nearest = tree.query(np.array(place))
        return not bool(joint.region.old[nearest])

    return carried_edits(log, joint.tables.gone, is_replaced)


def _figures(joint: _Joint, colours: tuple[str, ...]) -> Joined:
    """Return what the join did, for the manifest and the review."""
    old, new, region, tables = joint.old, joint.new, joint.region, joint.tables
    labels = old.instances.face_instance
    offsets = seam_offsets(old.mesh, labels, new.mesh, region, old.holds.unit)
    photographed = tables.added | tables.same
    return Joined(
        replaced_share=round(float(old.mesh.areas[~region.old].sum() / old.mesh.areas.sum()), 4),
        seam_mm=round(1000 * float(np.percentile(offsets, 95)) / old.holds.unit, 2)
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
            for line in seam_lines(old.mesh, region.old, old.holds.unit)
        ),
        colours=colours,
        missing=tuple(joint.choice.missing(region, old.holds)),
        ignored=joint.choice.ignored(region, new.holds) if colours else 0,
    )
