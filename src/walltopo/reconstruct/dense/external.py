"""The backends `colmap` (PatchMatch on CUDA) and `openmvs`."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import EnvironmentLacksError, Mesh, Progress, StageError
from walltopo.geometry.ply import read_mesh
from walltopo.geometry.subdivision import drop_wide, split_long_edges
from walltopo.geometry.topology import compact
from walltopo.reconstruct.dense.remesh import finish
from walltopo.reconstruct.dense.scene import ground_sampling, read_scene, surroundings
from walltopo.reconstruct.dense.settings import DenseSettings
from walltopo.reconstruct.openmvs import (
    find_programs,
    import_scene,
    run_program,
    undistorted_workspace,
)


def has_cuda() -> bool:
    """Whether pycolmap was built with CUDA and the machine has a device for it."""
    from walltopo.geometry.colmap import pycolmap

    return bool(pycolmap.has_cuda) and cuda_devices() > 0


def cuda_devices() -> int:
    """Devices that the CUDA driver sees; 0 without a driver.

    The driver is asked: pycolmap's own count, where it has one, fails hard without a driver.
    """
    import ctypes

    name = "nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1"
    try:
        driver = ctypes.CDLL(name)
    except OSError:
        return 0
    count = ctypes.c_int(0)
    if driver.cuInit(0) != 0 or driver.cuDeviceGetCount(ctypes.byref(count)) != 0:
        return 0
    return count.value


def need_cuda() -> None:
    """Raises EnvironmentLacksError where PatchMatch cannot run."""
    if not has_cuda():
        raise EnvironmentLacksError(
            "dense.backend = colmap needs a pycolmap with CUDA and a device for it",
            "Install pycolmap-cuda12 in its place on a machine with an NVIDIA GPU, or use "
            "dense.backend = sgm.",
        )


def colmap_mesh(
    sparse: Path,
    photos: Path,
    work: Path,
    settings: DenseSettings,
    edge: float,
    unit: float,
    progress: Progress,
) -> Mesh:
    """A clean mesh by COLMAP.

    Parameters
    ----------
    sparse, photos : the COLMAP model and the folder of its photos.
    work : an empty folder for intermediate files (a few MB per photo).
    settings, edge, unit, progress : as in `sgm.sgm_mesh`.

    Raises
    ------
    EnvironmentLacksError : no CUDA in pycolmap, or no device.
    StageError : the fusion found no points.
    """
    need_cuda()
    from walltopo.geometry.colmap import pycolmap

    undistorted_workspace(sparse, photos, work, settings.max_size, progress)
    progress.step("PatchMatch stereo")
    pycolmap.patch_match_stereo(work, options=pycolmap.PatchMatchOptions())
    progress.step("fusing depth maps")
    fused = pycolmap.stereo_fusion(work / "fused.ply", work, output_type="PLY")
    if fused.num_points3D() == 0:
        raise StageError("COLMAP's fusion found no points", "Take more photos with more overlap.")
    progress.step("meshing")
    pycolmap.poisson_meshing(work / "fused.ply", work / "poisson.ply")
    return finish(read_mesh(work / "poisson.ply"), settings, edge, unit)


# PatchMatch's time grows with pixels x views x rounds. On a CPU these are a third of its defaults'.
_VIEWS = 4

_ROUNDS = 2

_GEOMETRIC_ROUNDS = 0

# OpenMVS guesses a region of interest, and whether the scene is a tower, from where the cameras
# look; in front of a wall both guesses cut parts of it off. It is cropped here, as for `sgm`.
_NO_GUESSES = ["--estimate-roi", "0", "--crop-to-roi", "0", "--tower-mode", "0"]

# Points closer than this share of an edge are one to the triangulation.
_POINT_DISTANCE = 0.7

# Its own remeshing (--edge-length) crashes in 2.3.0 (openMVS issue 926), so longer edges are
# split here: those longer than this many times the edge wanted (Botsch and Kobbelt, 2004).
_LONGEST_EDGE = 4 / 3


def densify_arguments(scene: Path, dense: Path, max_size: int) -> list[str]:
    """DensifyPointCloud: depth maps at the photos' size, fused.

    Parameters
    ----------
    scene, dense : absolute paths of the .mvs read and written; the points lie beside it, .ply.
    max_size : longer side of the photos that stereo sees, pixels.
    """
    size = ["--resolution-level", "0", "--max-resolution", str(max_size)]
    effort = ["--number-views", str(_VIEWS), "--iters", str(_ROUNDS)]
    effort += ["--geometric-iters", str(_GEOMETRIC_ROUNDS)]
    return ["-i", str(scene), "-o", str(dense), *size, *effort, *_NO_GUESSES]


def mesh_arguments(dense: Path, mesh: Path, edge: float, pixel: float) -> list[str]:
    """ReconstructMesh: a surface through the points.

    Parameters
    ----------
    dense, mesh : absolute paths of the .mvs read and the .ply written.
    edge : edge length wanted, world units.
    pixel : a pixel's size on the surface in the photos that stereo saw, world units.
    """
    points = ["-p", str(dense.with_suffix(".ply"))]
    fineness = ["--min-point-distance", f"{_POINT_DISTANCE * edge / pixel:.3f}"]
    return ["-i", str(dense), *points, "-o", str(mesh), *fineness, "--crop-to-roi", "0"]


def refine_arguments(dense: Path, mesh: Path, refined: Path) -> list[str]:
    """RefineMesh: vertices moved until the photos agree; absolute paths, the mesh's edges kept."""
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
    """A clean mesh by OpenMVS; parameters as in `colmap.colmap_mesh`.

    Raises
    ------
    EnvironmentLacksError : a program is missing.
    StageError : a program failed or wrote no mesh.
    """
    programs = find_programs(settings.openmvs_bin)
    view = read_scene(sparse)
    work = work.resolve()
    undistorted_workspace(sparse.resolve(), photos.resolve(), work, settings.max_size, progress)
    scene = import_scene(programs["InterfaceCOLMAP"], work, progress)
    dense, surface = work / "dense.mvs", work / "surface.ply"
    arguments = densify_arguments(scene, dense, settings.max_size)
    run_program(programs["DensifyPointCloud"], arguments, work, progress)
    longest = max(max(v.camera.width, v.camera.height) for v in view.views)
    pixel = ground_sampling(view) * max(1.0, longest / settings.max_size)
    arguments = mesh_arguments(dense, surface, edge, pixel)
    run_program(programs["ReconstructMesh"], arguments, work, progress)
    if settings.openmvs_refine:
        rough, surface = surface, work / "refined.ply"
        arguments = refine_arguments(dense, rough, surface)
        run_program(programs["RefineMesh"], arguments, work, progress)
    if not surface.is_file():
        raise StageError(f"OpenMVS wrote no mesh at {surface}", f"Its logs (*.log) are in {work}.")
    mesh = _inside(read_mesh(surface), *surroundings(view))
    # What is no hole to be closed is none to be bridged: the triangulation closes everything.
    mesh = finish(drop_wide(mesh, settings.max_hole * unit), settings, edge, unit)
    return split_long_edges(mesh, _LONGEST_EDGE * edge)


def _inside(mesh: Mesh, low: NDArray[np.float64], high: NDArray[np.float64]) -> Mesh:
    """The triangles whose middle lies within a box, (3,) corners each."""
    keep = ((mesh.centroids >= low) & (mesh.centroids <= high)).all(axis=1)
    return Mesh(*compact(mesh.vertices, mesh.faces[keep]))
