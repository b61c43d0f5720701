"""A first look at a wall while its scan runs, from what the finished stages made.

    python -m walltopo.pipeline.first_look SCAN OUT

writes the latest look as GLB.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, Silent
from walltopo.core.files import atomic_path
from walltopo.pipeline.runner import stored_plan
from walltopo.pipeline.workplace import is_locked
from walltopo.publish.settings import ExportSettings
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import WallModel
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest, StageRecord
from walltopo.scans.pictures import TextureUv
from walltopo.scans.scale import Scale

Look = Literal["scale", "dense", "texture"]
# The stages after which the wall looks otherwise, the latest first.
LOOKS: tuple[Look, ...] = ("texture", "dense", "scale")
TRIANGLES = 60_000
TEXTURE_SIDE = 2048  # pixels
_NEIGHBOURS = 4  # sparse points that colour a vertex


@dataclass(frozen=True)
class StageStatus:
    """A stage of a scan, and its state: "waiting", or that of its `StageRecord`."""

    name: str
    state: str
    seconds: float


@dataclass(frozen=True)
class ScanStatus:
    """How far a scan has come.

    Parameters
    ----------
    stages : in their order.
    running : whether a run works on the scan.
    look : identity of the latest look, "" before the first; it changes when the look does.
    problem : message of the stage that failed; empty without one.
    finished : whether the page of the scan is there.
    """

    stages: tuple[StageStatus, ...]
    running: bool
    look: str
    problem: str
    finished: bool


class FollowedScan:
    """A scan that `walltopo view` follows while it runs."""

    def __init__(self, folder: ScanFolder) -> None:
        self._folder = folder
        self.title = folder.root.resolve().name

    def status(self) -> ScanStatus:
        """Return how far the scan has come; see `scan_status`."""
        return scan_status(self._folder)

    def look(self, name: str) -> bytes:
        """Return the GLB of a look; see `first_look`."""
        return first_look(self._folder, name)


def scan_status(folder: ScanFolder) -> ScanStatus:
    """Return how far a scan has come.

    Raises
    ------
    InputError : the manifest is damaged, or its settings are of another version.
    """
    records = Manifest.load(folder.manifest).stages
    waiting = StageRecord("running")
    running = is_locked(folder)
    rows = []
    for step in stored_plan(folder):
        record = records.get(step.name)
        state = "waiting" if record is None else record.state
        if state == "running" and not running:  # the run was killed
            state = "interrupted"
        rows.append(StageStatus(step.name, state, (record or waiting).seconds))
    failed = [name for name, record in records.items() if record.state == "failed"]
    return ScanStatus(
        stages=tuple(rows),
        running=running,
        look=_look_of(records),
        problem=records[failed[0]].error.splitlines()[-1] if failed and not running else "",
        finished=folder.page.is_file(),
    )


def _look_of(records: dict[str, StageRecord]) -> str:
    for stage in LOOKS:
        record = records.get(stage)
        if record is not None and record.state == "done":
            return f"{stage}-{record.input_hash[:16]}"
    return ""


def first_look(folder: ScanFolder, look: str) -> bytes:
    """Return the GLB of a look, without holds and routes.

    After *scale* it is a coarse surface of the sparse points, after *dense* the mesh in the colours
    of the sparse points, after *texture* the textured mesh.

    Parameters
    ----------
    look : as `scan_status` names it.

    Raises
    ------
    InputError : a file is missing or damaged, or there is no such look.
    StageError : the sparse points suffice for no surface.
    """
    stage = look.partition("-")[0]
    if stage not in LOOKS:
        raise InputError(f"{folder.root}: there is no look {look!r}")
    scale = Scale.load(folder.scale)
    uv, texture = None, None
    if stage == "scale":
        mesh = _points_surface(folder, scale.metric)
    else:
        mesh = ScanFolder.mesh.load(folder)
        if stage == "dense":
            mesh = _coloured(mesh, folder.sparse)
        else:
            uv, texture = TextureUv.load(folder.texture_uv).uv, folder.texture
    wall = WallModel(
        mesh=mesh,
        face_instance=np.zeros(len(mesh.faces), dtype=np.int32),
        uv=uv,
        texture=texture,
        holds=[],
        routes=[],
        metric=scale.metric,
        title=folder.root.resolve().name,
    )
    settings = ExportSettings(
        surroundings=True, first_triangles=TRIANGLES, first_texture=TEXTURE_SIDE
    )
    return TierBuilder(wall, settings).glb("first")


def _points_surface(folder: ScanFolder, metric: bool) -> Mesh:
    """Return a coarse surface through the sparse points."""
    from walltopo.reconstruct.dense.make_mesh import edge_and_unit
    from walltopo.reconstruct.dense.scene import preview_mesh, read_scene

    scene = read_scene(folder.sparse)
    settings = DenseSettings()
    edge, unit = edge_and_unit(scene, settings, metric)
    return _coloured(preview_mesh(scene, settings, edge, unit, Silent()), folder.sparse)


def _coloured(mesh: Mesh, sparse: Path) -> Mesh:
    """Return the mesh with each vertex in the mean colour of the nearest sparse points."""
    from scipy.spatial import cKDTree

    from walltopo.scans.colmap_model import open_model

    points = open_model(sparse).points3D.values()
    rows = [(point.xyz, point.color) for point in points]
    places = np.array([place for place, _ in rows], dtype=np.float64)
    colours: NDArray[np.float64] = np.array([colour for _, colour in rows], dtype=np.float64)
    _, nearest = cKDTree(places).query(mesh.vertices, k=min(_NEIGHBOURS, len(rows)))
    mean = colours[nearest.reshape(len(mesh.vertices), -1)].mean(axis=1)
    return replace(mesh, vertex_colours=mean.round().astype(np.uint8))


def main() -> None:
    """Write the GLB of a scan's latest look, if there is one: a program of its own for servers."""
    folder, out = ScanFolder(sys.argv[1]), Path(sys.argv[2])
    look = scan_status(folder).look
    if look:
        with atomic_path(out) as temporary:
            temporary.write_bytes(first_look(folder, look))


if __name__ == "__main__":
    main()
