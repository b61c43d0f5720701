"""Put a ready mesh into the scan's frame, and check by rays that the photos see it there."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.geometry.rays import Bvh
from walltopo.geometry.similarity import Similarity, fit_poses
from walltopo.geometry.subdivision import split_long_edges, split_long_edges_with_uv
from walltopo.geometry.topology import compact_vertices
from walltopo.reconstruct.dense.mesh_file import read_mesh_file
from walltopo.reconstruct.dense.scene import Scene, meshing_box
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.artifacts import Context
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList
from walltopo.scans.pictures import TextureImage, TextureUv
from walltopo.scans.poses import GivenPoses

Floats = NDArray[np.float64]

_RAYS = 2000
_SEED = 0

# A point lies on the mesh if its ray meets the mesh within this share of the point's distance:
# 6 cm at 3 m, more than LiDAR meshes err.
_TOLERANCE = 0.02

_MIN_ON_MESH = 0.5  # share of the points; the rest is what the mesh lacks

# Units of a mesh per unit of the poses that are tried when the mesh does not fit.
_UNITS = (1.0, 1000.0, 100.0, 0.001, 0.01, 1 / 0.3048, 1 / 0.0254)

_LONGEST_EDGE = 4 / 3  # as of OpenMVS's mesh: triangles carry the holds' outlines

_COARSE = 32.0  # target edges; first, so that long triangles are cut well where the box ends

_MAX_FACES = 20_000_000


@dataclass(frozen=True, eq=False)
class GivenMesh:
    """A ready mesh in the world frame.

    Parameters
    ----------
    mesh, metrics : as of `external.make_mesh`.
    picture, uv : its texture, None without one.
    """

    mesh: Mesh
    picture: TextureImage | None
    uv: TextureUv | None
    metrics: Metrics


def place_mesh(
    scene: Scene,
    poses: GivenPoses,
    photos: PhotoList,
    shows_people: bool,
    edge: float,
    settings: DenseSettings,
    context: Context,
) -> GivenMesh:
    """Return the mesh of `settings.mesh` in the world frame.

    Parameters
    ----------
    shows_people : whether people were found in the photos.
    edge : target edge length, world units; longer edges are split.

    Raises
    ------
    InputError : the file is missing or damaged, or the photos do not see the mesh from their poses.
    """
    import cv2

    path = Path(settings.mesh)
    content = read_mesh_file(path, _why_painted(settings, shows_people))
    world_from_poses = _world_from_poses(scene, poses, photos)
    rays = _Rays.of(scene, content.mesh)
    found = _find_frame(rays, poses, world_from_poses, path, context)
    world_from_mesh = world_from_poses.after(found.poses_from_mesh)
    mesh, uv = world_from_mesh.mesh(content.mesh), content.uv
    if _faces_away(mesh, scene):
        mesh = Mesh(mesh.vertices, mesh.faces[:, ::-1])
        uv = None if uv is None else uv[:, ::-1]
    mesh, uv = _split_long_edges(mesh, uv, _COARSE * edge)
    whole = float(mesh.areas.sum())
    mesh, uv = _crop_to_photos(mesh, uv, scene)
    _check_size(mesh, edge, path)
    mesh, uv = _split_long_edges(mesh, uv, _LONGEST_EDGE * edge)
    context.progress.note(
        f"{path.name}: {_painter_words(content.lacks, has_texture=uv is not None)}"
    )
    picture = None
    if content.picture is not None:
        picture = TextureImage(context.scratch / "given.png")
        cv2.imwrite(str(picture.path), content.picture[..., ::-1])
    figures: Metrics = {
        "backend": "given",
        "reason": path.name,
        "vertices": len(mesh.vertices),
        "faces": len(mesh.faces),
        "area": round(float(mesh.areas.sum()), 3),
        "cut_off_area": round(whole - float(mesh.areas.sum()), 3),
        "on_mesh": round(found.share, 3),
        "distance": round(found.median * world_from_poses.scale * found.unit, 5),
        "own_texture": picture is not None,
    }
    return GivenMesh(
        mesh, picture, None if uv is None else TextureUv(uv.astype(np.float32)), figures
    )


def _painter_words(lacks: str, *, has_texture: bool) -> str:
    """Return in words what paints the mesh."""
    if not has_texture:
        return f"painted from the photos: {lacks}"
    return (
        "its own texture is used; people in it are not hidden (dense.mesh_texture=never paints the "
        "photos instead)"
    )


def _why_painted(settings: DenseSettings, shows_people: bool) -> str:
    """Return why the photos are painted although the mesh may have a texture; "" if they are not.

    People are hidden in the photos, and not in a texture that came with a mesh.
    """
    if settings.mesh_texture == "never":
        return "dense.mesh_texture is never"
    if settings.mesh_texture == "auto" and shows_people:
        return (
            "the photos show people, who may be in its own texture "
            "(dense.mesh_texture=always uses it)"
        )
    return ""


def _world_from_poses(scene: Scene, poses: GivenPoses, photos: PhotoList) -> Similarity:
    """Return the similarity from the frame of the poses to the world, by the placed cameras."""
    source_of = {photo.name: photo.source for photo in photos.photos}
    given = {photo.source: photo.view for photo in poses.photos}
    pairs = [
        (given[source_of[view.name]].cam_from_world, view.cam_from_world)
        for view in scene.views
        if source_of.get(view.name) in given
    ]
    if len(pairs) < 2:
        raise InputError(
            f"{poses.path}: has the poses of {len(pairs)} of the {len(scene.views)} placed photos; "
            "at least 2 are needed to place the mesh"
        )
    return fit_poses(np.array([a for a, _ in pairs]), np.array([b for _, b in pairs]))


@dataclass(frozen=True, eq=False)
class _Frame:
    """A candidate frame of the mesh, and how the points fit to it.

    Parameters
    ----------
    poses_from_mesh : the transform; unit : its scale; words : what it does, for people.
    share : share of the rays whose point lies on the mesh.
    median : median distance of the points along their rays, units of the mesh; inf if most miss.
    """

    poses_from_mesh: Similarity
    words: str
    share: float = 0.0
    median: float = float("inf")

    @property
    def unit(self) -> float:
        return self.poses_from_mesh.scale


@dataclass(frozen=True, eq=False)
class _Rays:
    """Rays from cameras to the points that they see, in the world frame, and the mesh.

    Parameters
    ----------
    origins, points : (n, 3) float.
    bvh : of the mesh in its own frame.
    mesh : the mesh in its own frame.
    """

    origins: Floats
    points: Floats
    bvh: Bvh
    mesh: Mesh

    @classmethod
    def of(cls, scene: Scene, mesh: Mesh) -> _Rays:
        """Return at most `_RAYS` rays, drawn evenly over all observations."""
        origins = [
            np.broadcast_to(view.centre, (len(seen), 3))
            for view, seen in zip(scene.views, scene.seen, strict=True)
        ]
        points = [scene.points[seen] for seen in scene.seen]
        starts, ends = np.concatenate(origins), np.concatenate(points)
        chosen = np.random.default_rng(_SEED).permutation(len(starts))[:_RAYS]
        return cls(starts[chosen], ends[chosen], Bvh(mesh.vertices, mesh.faces), mesh)

    def fit(self, world_from_poses: Similarity, frame: _Frame) -> _Frame:
        """Return the frame with the share and the distance of the points on the mesh."""
        mesh_from_world = world_from_poses.after(frame.poses_from_mesh).inverse()
        starts, ends = mesh_from_world.apply(self.origins), mesh_from_world.apply(self.points)
        towards = ends - starts
        _, t = self.bvh.first_hit(starts, towards)
        off = np.abs(t - 1.0)
        depth = np.linalg.norm(towards, axis=1)
        near = off <= _TOLERANCE
        median = float(np.median(off[near] * depth[near])) if near.any() else float("inf")
        return _Frame(frame.poses_from_mesh, frame.words, float(near.mean()), median)


def _find_frame(
    rays: _Rays, poses: GivenPoses, world_from_poses: Similarity, path: Path, context: Context
) -> _Frame:
    """Return the frame in which the photos see the mesh.

    The frame of the poses and that of the app's own mesh come first. Then turned axes and other
    units are tried, and are accepted only if a single one fits.

    Raises
    ------
    InputError : the photos do not see the mesh, or in several ways.
    """
    first = [rays.fit(world_from_poses, frame) for frame in _declared_frames(poses)]
    best = max(first, key=lambda frame: frame.share)
    if best.share >= _MIN_ON_MESH:
        return best
    tried = [rays.fit(world_from_poses, frame) for frame in _turned_frames()]
    fitting = [frame for frame in tried if frame.share >= _MIN_ON_MESH]
    if len(fitting) == 1:
        frame = fitting[0]
        context.progress.note(
            f"{path.name}: is in another frame than the poses: {frame.words}; by that, "
            f"{frame.share:.0%} of the points lie on it, so it was moved"
        )
        return frame
    low, high = rays.mesh.vertices.min(axis=0), rays.mesh.vertices.max(axis=0)
    points = world_from_poses.inverse().apply(rays.points)
    if fitting:
        also = f"It would fit in {len(fitting)} ways: {'; '.join(f.words for f in fitting[:3])}."
    else:
        also = "Neither turned axes nor millimetres, centimetres, feet or inches explain it."
    raise InputError(
        f"{path}: the photos do not see this mesh from the poses of {poses.path}: "
        f"{best.share:.0%} of the points that they show lie on it. The mesh spans "
        f"{_box(low, high)}, the points {_box(*np.percentile(points, (2, 98), axis=0))} in the "
        f"frame of the poses. {also}",
        "Export the mesh and the poses from one project, with the same origin, axes and unit.",
    )


def _box(low: Floats, high: Floats) -> str:
    return " x ".join(f"{a:.4g} to {b:.4g}" for a, b in zip(low, high, strict=True))


_IDENTITY = Similarity(1.0, np.eye(3), np.zeros(3))


def _declared_frames(poses: GivenPoses) -> Iterator[_Frame]:
    """Yield the frame of the poses, and that of the app's own mesh if it has another."""
    yield _Frame(_IDENTITY, "the same frame")
    if poses.mesh_frame is not None:
        yield _Frame(poses.mesh_frame.similarity.inverse(), "the app's frame of its mesh")


def _turned_frames() -> Iterator[_Frame]:
    """Yield all turns by quarters about the axes, in several units."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            rotation = np.zeros((3, 3))
            rotation[np.arange(3), order] = signs
            if np.linalg.det(rotation) < 0:
                continue
            axes = ", ".join(
                f"{'-' if sign < 0 else ''}{'xyz'[k]}" for k, sign in zip(order, signs, strict=True)
            )
            for unit in _UNITS:
                size = "" if unit == 1.0 else f", and its unit is 1/{unit:.4g} of theirs"
                words = f"x, y, z of the poses are its {axes}{size}"
                yield _Frame(Similarity(1.0 / unit, rotation, np.zeros(3)), words)


def _faces_away(mesh: Mesh, scene: Scene) -> bool:
    """Return whether most of the triangles that cameras see show them their back."""
    bvh = Bvh(mesh.vertices, mesh.faces)
    front = back = 0
    for view, seen in zip(scene.views, scene.seen, strict=True):
        if len(seen):
            towards = scene.points[seen] - view.centre
            face, _ = bvh.first_hit(np.broadcast_to(view.centre, towards.shape), towards)
            hit = face >= 0
            facing = (mesh.normals[face[hit]] * towards[hit]).sum(axis=1) < 0
            front, back = front + int(facing.sum()), back + int((~facing).sum())
    return back > front


def _split_long_edges(mesh: Mesh, uv: Floats | None, longest: float) -> tuple[Mesh, Floats | None]:
    """Return the mesh, and its texture coordinates if any, with shorter edges."""
    if uv is None:
        return split_long_edges(mesh, longest), None
    return split_long_edges_with_uv(mesh, uv, longest)


def _crop_to_photos(mesh: Mesh, uv: Floats | None, scene: Scene) -> tuple[Mesh, Floats | None]:
    """Return the part in the box that the photos show: a room's other walls would cost much."""
    low, high = meshing_box(scene)
    keep = ((mesh.centroids >= low) & (mesh.centroids <= high)).all(axis=1)
    part = Mesh(*compact_vertices(mesh.vertices, mesh.faces[keep]))
    return part, None if uv is None else uv[keep]


def _check_size(mesh: Mesh, edge: float, path: Path) -> None:
    """Raise InputError if the mesh would have too many triangles of the target size."""
    expected = len(mesh.faces) + float(mesh.areas.sum()) / (0.43 * edge**2)
    if expected > _MAX_FACES:
        raise InputError(
            f"{path}: its {mesh.areas.sum():.0f} square units would be {expected:.2g} triangles",
            "Cut the mesh to the wall, or set a longer dense.edge_length.",
        )
