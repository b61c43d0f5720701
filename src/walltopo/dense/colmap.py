"""The `colmap` backend: PatchMatch stereo on CUDA, fusion and Poisson meshing by pycolmap."""

from __future__ import annotations

import sys
from pathlib import Path

from walltopo.core import EnvironmentLacksError, Mesh, Progress, StageError
from walltopo.dense.contract import DenseSettings
from walltopo.dense.remesh import finish
from walltopo.meshes.ply import read_mesh
from walltopo.openmvs.workspace import undistorted_workspace

__all__ = ["colmap_mesh", "cuda_devices", "has_cuda", "need_cuda"]


def has_cuda() -> bool:
    """Whether pycolmap was built with CUDA and the machine has a device for it."""
    from walltopo.colmap import pycolmap

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
    from walltopo.colmap import pycolmap

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
