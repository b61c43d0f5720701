"""OpenMVS as a dense backend: runs its programs on undistorted photos."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError
from walltopo.geometry.mesh_files import read_mesh
from walltopo.geometry.subdivision import drop_long_triangles, split_long_edges
from walltopo.geometry.topology import compact_vertices
from walltopo.reconstruct.dense.backend import DenseInput
from walltopo.reconstruct.dense.remesh import finish_surface
from walltopo.reconstruct.dense.scene import median_pixel_size, meshing_box, read_scene
from walltopo.reconstruct.dense.work_folder import work_folder
from walltopo.reconstruct.openmvs import (
    find_programs,
    import_scene,
    run_program,
    write_undistorted_workspace,
)
from walltopo.reconstruct.settings import DenseSettings

# PatchMatch's time grows with pixels x views x rounds. These values take a third of the time of
# OpenMVS's defaults on a CPU.
_VIEWS = 4

_ROUNDS = 2

_GEOMETRIC_ROUNDS = 0

# OpenMVS guesses a region of interest, and whether the scene is a tower, from where the cameras
# look; in front of a wall both guesses cut parts of it off. `_crop_to_box` crops the mesh instead.
_NO_CROPPING = ["--estimate-roi", "0", "--crop-to-roi", "0", "--tower-mode", "0"]

# The triangulation merges points closer than this share of an edge.
_POINT_DISTANCE = 0.7

# OpenMVS's remeshing (--edge-length) crashes in 2.3.0 (openMVS issue 926), so edges longer than
# this many target edge lengths are split here (Botsch and Kobbelt, 2004).
_LONGEST_EDGE = 4 / 3


def densify_arguments(scene: Path, dense: Path, max_size: int) -> list[str]:
    """Return the arguments of DensifyPointCloud: depth maps at the photos' size, fused.

    Parameters
    ----------
    scene, dense : absolute paths of the .mvs read and written; the points go to a .ply beside it.
    max_size : longer side of the photos used for stereo, pixels.
    """
    size = ["--resolution-level", "0", "--max-resolution", str(max_size)]
    effort = ["--number-views", str(_VIEWS), "--iters", str(_ROUNDS)]
    effort += ["--geometric-iters", str(_GEOMETRIC_ROUNDS)]
    return ["-i", str(scene), "-o", str(dense), *size, *effort, *_NO_CROPPING]


def mesh_arguments(dense: Path, mesh: Path, edge: float, pixel: float) -> list[str]:
    """Return the arguments of ReconstructMesh: a surface through the points.

    Parameters
    ----------
    dense, mesh : absolute paths of the .mvs read and the .ply written.
    edge : target edge length, world units.
    pixel : size of a photo pixel on the surface at stereo resolution, world units.
    """
    points = ["-p", str(dense.with_suffix(".ply"))]
    fineness = ["--min-point-distance", f"{_POINT_DISTANCE * edge / pixel:.3f}"]
    return ["-i", str(dense), *points, "-o", str(mesh), *fineness, "--crop-to-roi", "0"]


def refine_arguments(dense: Path, mesh: Path, refined: Path) -> list[str]:
    """Return the arguments of RefineMesh, which moves vertices until the photos agree. Paths are
    absolute; the mesh keeps its edges."""
    keep = ["--decimate", "1", "--ensure-edge-size", "0", "--max-face-area", "0"]
    return ["-i", str(dense), "-m", str(mesh), "-o", str(refined), *keep, "--close-holes", "0"]


def openmvs_mesh(
    sparse: Path,
    photos: Path,
    work: Path,
    settings: DenseSettings,
    edge: float,
    unit: float,
    progress: Progress,
) -> Mesh:
    """Compute a clean mesh with OpenMVS; parameters as in `colmap.colmap_mesh`.

    Raises
    ------
    EnvironmentLacksError : a program is missing.
    StageError : a program failed or wrote no mesh.
    """
    programs = find_programs(settings.openmvs_bin)
    views = read_scene(sparse)
    work = work.resolve()
    write_undistorted_workspace(
        sparse.resolve(), photos.resolve(), work, settings.max_size, progress
    )
    scene = import_scene(programs["InterfaceCOLMAP"], work, progress)
    dense, surface = work / "dense.mvs", work / "surface.ply"
    arguments = densify_arguments(scene, dense, settings.max_size)
    run_program(programs["DensifyPointCloud"], arguments, work, progress)
    longest = max(max(v.camera.width, v.camera.height) for v in views.views)
    pixel = median_pixel_size(views) * max(1.0, longest / settings.max_size)
    arguments = mesh_arguments(dense, surface, edge, pixel)
    run_program(programs["ReconstructMesh"], arguments, work, progress)
    if settings.openmvs_refine:
        rough, surface = surface, work / "refined.ply"
        arguments = refine_arguments(dense, rough, surface)
        run_program(programs["RefineMesh"], arguments, work, progress)
    if not surface.is_file():
        raise StageError(f"OpenMVS wrote no mesh at {surface}", f"Its logs (*.log) are in {work}.")
    mesh = _crop_to_box(read_mesh(surface), *meshing_box(views))
    # The triangulation closes every opening; reopen those wider than the limit for holes.
    mesh = finish_surface(drop_long_triangles(mesh, settings.max_hole * unit), settings, edge, unit)
    return split_long_edges(mesh, _LONGEST_EDGE * edge)


def _crop_to_box(mesh: Mesh, low: NDArray[np.float64], high: NDArray[np.float64]) -> Mesh:
    """Return the triangles whose centroid lies in a box; corners (3,)."""
    keep = ((mesh.centroids >= low) & (mesh.centroids <= high)).all(axis=1)
    return Mesh(*compact_vertices(mesh.vertices, mesh.faces[keep]))


@dataclass(frozen=True)
class OpenmvsBackend:
    """OpenMVS's dense reconstruction, a `DenseBackend`."""

    name: str
    settings: DenseSettings

    def check(self) -> None:
        """Raise EnvironmentLacksError if a program is missing."""
        find_programs(self.settings.openmvs_bin)

    def mesh(self, scan: DenseInput) -> Mesh:
        """Return the mesh; see `openmvs_mesh`."""
        with work_folder(self.name, scan.cache) as work:
            return openmvs_mesh(
                scan.sparse.folder,
                scan.photos.folder,
                work,
                self.settings,
                scan.edge,
                scan.unit,
                scan.progress,
            )
