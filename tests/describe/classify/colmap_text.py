"""Cameras written as COLMAP's text model."""

from __future__ import annotations

from pathlib import Path

from scipy.spatial.transform import Rotation

from walltopo.core import View


def write_model(folder: Path, views: list[View]) -> None:
    """COLMAP's text model without points."""
    folder.mkdir()
    camera = views[0].camera
    numbers = " ".join(str(p) for p in camera.params)
    cameras = f"1 {camera.model} {camera.width} {camera.height} {numbers}\n"
    (folder / "cameras.txt").write_text(cameras)
    lines = []
    for number, view in enumerate(views, start=1):
        x, y, z, w = Rotation.from_matrix(view.cam_from_world[:, :3]).as_quat()
        t = " ".join(str(v) for v in view.cam_from_world[:, 3])
        lines.append(f"{number} {w} {x} {y} {z} {t} 1 {view.name}\n\n")
    (folder / "images.txt").write_text("".join(lines))
    (folder / "points3D.txt").write_text("")
