"""The COLMAP workspace of undistorted photos that other programs' stereo starts from."""

from __future__ import annotations

from pathlib import Path

from walltopo.core import Progress

__all__ = ["undistorted_workspace"]


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
    import pycolmap

    progress.step("undistorting photos")
    options = pycolmap.UndistortCameraOptions(max_image_size=max_size)
    pycolmap.undistort_images(work, sparse, photos, undistort_options=options)
