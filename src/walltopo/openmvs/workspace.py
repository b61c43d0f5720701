"""The COLMAP workspace of undistorted photos that other programs start from."""

from __future__ import annotations

from pathlib import Path

from walltopo.core import Progress
from walltopo.openmvs.programs import run_program

__all__ = ["import_scene", "undistorted_workspace"]


def undistorted_workspace(
    sparse: Path, photos: Path, work: Path, max_size: int, progress: Progress
) -> None:
    """Write `images/` and `sparse/` of pinhole cameras into `work`.

    Parameters
    ----------
    sparse, photos : the COLMAP model and the folder of its photos.
    work : an empty folder.
    max_size : longer side of the photos written, pixels; smaller ones keep their size.
    """
    from walltopo.colmap import pycolmap

    progress.step("undistorting photos")
    options = pycolmap.UndistortCameraOptions(max_image_size=max_size)
    level = pycolmap.logging.minloglevel
    # It reports every photo otherwise, into the middle of the progress shown.
    pycolmap.logging.minloglevel = pycolmap.logging.Level.WARNING.value
    try:
        pycolmap.undistort_images(work, sparse, photos, undistort_options=options)
    finally:
        pycolmap.logging.minloglevel = level


def import_scene(program: Path, work: Path, progress: Progress) -> Path:
    """OpenMVS's scene file, made from an undistorted workspace by InterfaceCOLMAP.

    Parameters
    ----------
    program : path of InterfaceCOLMAP.
    work : absolute path of the workspace.
    """
    scene = work / "scene.mvs"
    folders = ["-i", str(work), "--image-folder", str(work / "images")]
    run_program(program, [*folders, "-o", str(scene)], work, progress)
    return scene
