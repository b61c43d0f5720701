"""The `colmap` backend: PatchMatch stereo on CUDA, fusion and Poisson meshing by pycolmap."""

from __future__ import annotations

from pathlib import Path

from walltopo.core import EnvironmentLacksError, Mesh, Progress, StageError
from walltopo.dense.contract import DenseSettings
from walltopo.dense.remesh import finish
from walltopo.dense.undistorted import undistorted_workspace
from walltopo.meshes.ply import read_mesh

__all__ = ["colmap_mesh", "has_cuda"]


def has_cuda() -> bool:
    """Whether pycolmap was built with CUDA and sees a device."""
    import pycolmap

    return bool(pycolmap.has_cuda)


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
    EnvironmentLacksError : pycolmap has no CUDA.
    StageError : the fusion found no points.
    """
    if not has_cuda():
        raise EnvironmentLacksError(
            "dense.backend = colmap needs a pycolmap with CUDA, and this one has none",
            "Install pycolmap-cuda12 in its place on a machine with an NVIDIA GPU, or use "
            "dense.backend = sgm.",
        )
    import pycolmap

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
