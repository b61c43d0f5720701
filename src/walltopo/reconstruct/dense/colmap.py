"""COLMAP's PatchMatch as a dense backend: needs a pycolmap with CUDA, and a device."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from walltopo.core import EnvironmentLacksError, Mesh, Progress, StageError
from walltopo.geometry.mesh_files import read_mesh
from walltopo.reconstruct.dense.backend import DenseInput
from walltopo.reconstruct.dense.remesh import finish_surface
from walltopo.reconstruct.dense.work_folder import work_folder
from walltopo.reconstruct.openmvs import write_undistorted_workspace
from walltopo.reconstruct.settings import DenseSettings


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


@dataclass(frozen=True)
class ColmapBackend:
    """COLMAP's dense reconstruction, a `DenseBackend`."""

    name: str
    settings: DenseSettings

    def check(self) -> None:
        """Raise EnvironmentLacksError if PatchMatch cannot run."""
        require_cuda()

    def mesh(self, scan: DenseInput) -> Mesh:
        """Return the mesh; see `colmap_mesh`."""
        with work_folder(self.name, scan.cache) as work:
            return colmap_mesh(
                scan.sparse.folder,
                scan.photos.folder,
                work,
                self.settings,
                scan.edge,
                scan.unit,
                scan.progress,
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
    return finish_surface(read_mesh(work / "poisson.ply"), settings, edge, unit)
