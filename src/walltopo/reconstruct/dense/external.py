"""Choose and run the dense backend of a scan; run COLMAP's and OpenMVS's."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import EnvironmentLacksError, Mesh, Progress, StageError
from walltopo.geometry.mesh_files import read_mesh
from walltopo.geometry.subdivision import drop_long_triangles, split_long_edges
from walltopo.geometry.topology import compact, side_lengths
from walltopo.reconstruct.dense.guess import guess_holes
from walltopo.reconstruct.dense.remesh import finish
from walltopo.reconstruct.dense.scene import (
    Scene,
    median_pixel_size,
    meshing_box,
    preview_mesh,
    read_scene,
)
from walltopo.reconstruct.dense.sgm import sgm_mesh
from walltopo.reconstruct.openmvs import (
    find_programs,
    import_scene,
    run_program,
    write_undistorted_workspace,
)
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.artifacts import Context
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet


def has_cuda() -> bool:
    """Return whether pycolmap was built with CUDA and the machine has a CUDA device."""
    from walltopo.geometry.colmap import pycolmap

    return bool(pycolmap.has_cuda) and cuda_devices() > 0


def cuda_devices() -> int:
    """Return the number of devices that the CUDA driver sees; 0 without a driver.

    The driver is queried directly because pycolmap's own count aborts without a driver.
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


def require_cuda() -> None:
    """Raise EnvironmentLacksError if PatchMatch cannot run."""
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
    """Compute a clean mesh with COLMAP's PatchMatch, fusion and Poisson meshing.

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
    require_cuda()
    from walltopo.geometry.colmap import pycolmap

    write_undistorted_workspace(sparse, photos, work, settings.max_size, progress)
    progress.step("PatchMatch stereo")
    pycolmap.patch_match_stereo(work, options=pycolmap.PatchMatchOptions())
    progress.step("fusing depth maps")
    fused = pycolmap.stereo_fusion(work / "fused.ply", work, output_type="PLY")
    if fused.num_points3D() == 0:
        raise StageError("COLMAP's fusion found no points", "Take more photos with more overlap.")
    progress.step("meshing")
    pycolmap.poisson_meshing(work / "fused.ply", work / "poisson.ply")
    return finish(read_mesh(work / "poisson.ply"), settings, edge, unit)


# PatchMatch's time grows with pixels x views x rounds. These values take a third of the time of
# OpenMVS's defaults on a CPU.
_VIEWS = 4

_ROUNDS = 2

_GEOMETRIC_ROUNDS = 0

# OpenMVS guesses a region of interest, and whether the scene is a tower, from where the cameras
# look; in front of a wall both guesses cut parts of it off. `_crop` crops the mesh instead.
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
    """Compute a clean mesh with OpenMVS; parameters as in `colmap_mesh`.

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
    mesh = _crop(read_mesh(surface), *meshing_box(views))
    # The triangulation closes every opening; reopen those wider than the limit for holes.
    mesh = finish(drop_long_triangles(mesh, settings.max_hole * unit), settings, edge, unit)
    return split_long_edges(mesh, _LONGEST_EDGE * edge)


def _crop(mesh: Mesh, low: NDArray[np.float64], high: NDArray[np.float64]) -> Mesh:
    """Return the triangles whose centroid lies in a box; corners (3,)."""
    keep = ((mesh.centroids >= low) & (mesh.centroids <= high)).all(axis=1)
    return Mesh(*compact(mesh.vertices, mesh.faces[keep]))


# In an unscaled scan, lengths in the settings count a metre as this share of the scene's diagonal.
_UNSCALED_METRE = 0.1


def edge_and_unit(scene: Scene, settings: DenseSettings, metric: bool) -> tuple[float, float]:
    """Return the target edge length and the length of a settings metre, both in world units.

    In a metric scan the edge is `settings.edge_length`, but never finer than the photos show
    (half of `settings.edge_pixels` pixels, because stereo resolves about a pixel). In an unscaled
    scan the edge is `settings.edge_pixels` pixels; a metre is a tenth of the scene's diagonal.
    """
    pixel = median_pixel_size(scene)
    if metric:
        return max(settings.edge_length, 0.5 * settings.edge_pixels * pixel), 1.0
    low, high = meshing_box(scene)
    return settings.edge_pixels * pixel, _UNSCALED_METRE * float(np.linalg.norm(high - low))


def pick_backend(settings: DenseSettings) -> tuple[str, str]:
    """Return the backend for this machine and the reason of the choice.

    `auto` takes COLMAP's PatchMatch if pycolmap has CUDA and a device, else the embedded
    stereo: OpenMVS on a CPU was slower and less complete (docs/dense.md). A backend that the
    settings name is never replaced; it raises an error if the machine lacks something.
    """
    if settings.backend != "auto":
        return settings.backend, "as asked"
    if has_cuda():
        return "colmap", "pycolmap has CUDA and a device"
    return "sgm", "no CUDA for pycolmap"


def _run_backend(
    photos: PhotoSet,
    sparse: SparseModel,
    scene: Scene,
    backend: str,
    settings: DenseSettings,
    edge: float,
    unit: float,
    context: Context,
) -> Mesh:
    """Run one backend."""
    if backend == "sgm":
        load, progress, hidden = photos.read_grey, context.progress, photos.people_mask
        return sgm_mesh(scene, load, settings, edge, unit, progress, context.cache, hidden)
    if backend == "sparse":
        return preview_mesh(scene, settings, edge, unit, context.progress)
    external = colmap_mesh if backend == "colmap" else openmvs_mesh
    work = Path(tempfile.mkdtemp(prefix=f"{backend}-", dir=context.cache))
    mesh = external(sparse.folder, photos.folder, work, settings, edge, unit, context.progress)
    # After an error the folder stays, because it holds the logs.
    shutil.rmtree(work)
    return mesh


def make_mesh(
    photos: PhotoSet,
    sparse: SparseModel,
    metric: bool,
    settings: DenseSettings,
    context: Context,
) -> tuple[Mesh, Metrics]:
    """Compute the mesh of the scan from its cameras and photos."""
    scene = read_scene(sparse.folder)
    edge, unit = edge_and_unit(scene, settings, metric)
    backend, reason = pick_backend(settings)
    context.progress.note(
        f"dense: {backend} ({reason}), edges of about {_format_length(edge, metric)}"
    )
    measured = _run_backend(photos, sparse, scene, backend, settings, edge, unit, context)
    length = float(np.median(side_lengths(measured)))
    largest = settings.max_guess * unit
    guesses = guess_holes(measured, scene, largest, length, context.progress)
    mesh = guesses.mesh
    return (
        mesh,
        {
            "backend": backend,
            "reason": reason,
            "vertices": len(mesh.vertices),
            "faces": len(mesh.faces),
            "area": round(float(mesh.areas[mesh.measured].sum()), 3),
            "guessed_area": round(float(mesh.areas[~mesh.measured].sum()), 3),
            "guessed_holes": guesses.spanned,
            "seen_through": guesses.seen_through,
            "edge_length": round(length, 6),
            "metric": metric,
        },
    )


def _format_length(value: float, metric: bool) -> str:
    return f"{value * 1000:.1f} mm" if metric else f"{value:.4g} units"
