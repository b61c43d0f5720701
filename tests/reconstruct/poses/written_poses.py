"""Write poses in the layout and the convention of each format, from its documentation."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from walltopo.core import Camera, View

SIZE = (640, 480)
_GL = np.diag([1.0, -1.0, -1.0])


def _world_from_cam(view: View, opengl: bool) -> np.ndarray:
    rotation = view.cam_from_world[:, :3].T
    return np.column_stack([rotation @ _GL if opengl else rotation, view.centre])


def _brown(camera: Camera) -> tuple[float, ...]:
    """Return k1, k2, p1, p2, k3 of OpenCV."""
    if camera.model == "SIMPLE_RADIAL":
        return (*camera.distortion, 0.0, 0.0, 0.0, 0.0)
    return (*camera.distortion, *[0.0] * 5)[:5]


def write_polycam(folder: Path, views: Sequence[View]) -> None:
    cameras = folder / "keyframes" / "corrected_cameras"
    cameras.mkdir(parents=True)
    for view in views:
        pose, camera = _world_from_cam(view, opengl=True), view.camera
        entry = {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
        entry |= {"width": camera.width, "height": camera.height, "blur_score": 90.0}
        entry |= {f"t_{i}{j}": pose[i, j] for i in range(3) for j in range(4)}
        (cameras / f"{Path(view.name).stem}.json").write_text(json.dumps(entry), "utf-8")


def write_record3d(folder: Path, views: Sequence[View]) -> None:
    rows = []
    for view in views:
        pose = _world_from_cam(view, opengl=True)
        rows.append([*Rotation.from_matrix(pose[:, :3]).as_quat(), *pose[:, 3]])
    focal = views[0].camera.fx
    content = {"w": SIZE[0], "h": SIZE[1], "fps": 60, "poses": rows}
    content["K"] = [focal, 0, 0, 0, focal, 0, SIZE[0] / 2, SIZE[1] / 2, 1]
    (folder / "metadata").write_text(json.dumps(content), "utf-8")


def write_nerfstudio(folder: Path, views: Sequence[View]) -> None:
    frames = []
    for view in views:
        pose = np.vstack([_world_from_cam(view, opengl=True), [0, 0, 0, 1]])
        entry = {"file_path": f"images/{view.name}", "transform_matrix": pose.tolist()}
        camera = view.camera
        entry |= {"w": camera.width, "h": camera.height, "fl_x": camera.fx, "fl_y": camera.fy}
        entry |= {"cx": camera.cx, "cy": camera.cy}
        if camera.model == "OPENCV_FISHEYE":
            entry |= dict(zip(("k1", "k2", "k3", "k4"), camera.distortion, strict=True))
        else:
            entry |= dict(zip(("k1", "k2", "p1", "p2", "k3"), _brown(camera), strict=True))
        frames.append(entry)
    fisheye = views[0].camera.model == "OPENCV_FISHEYE"
    content = {"camera_model": "OPENCV_FISHEYE" if fisheye else "OPENCV", "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(content), "utf-8")


def write_colmap(folder: Path, views: Sequence[View]) -> None:
    folder = folder / "sparse" / "0"
    folder.mkdir(parents=True)
    cameras, images = [], []
    for number, view in enumerate(views, start=1):
        camera = view.camera
        values = " ".join(map(repr, camera.params))
        cameras.append(f"{number} {camera.model} {camera.width} {camera.height} {values}")
        x, y, z, w = Rotation.from_matrix(view.cam_from_world[:, :3]).as_quat().tolist()
        a, b, c = view.cam_from_world[:, 3].tolist()
        images += [f"{number} {w!r} {x!r} {y!r} {z!r} {a!r} {b!r} {c!r} {number} {view.name}", ""]
    (folder / "cameras.txt").write_text("\n".join(cameras) + "\n", "utf-8")
    (folder / "images.txt").write_text("\n".join(images) + "\n", "utf-8")
    (folder / "points3D.txt").write_text("", "utf-8")


_XMP = """<x:xmpmeta xmlns:x="adobe:ns:meta/">
  <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
    <rdf:Description xcr:Version="3" xcr:PosePrior="initial" xcr:Coordinates="absolute"
       xcr:DistortionModel="brown3" xcr:FocalLength35mm="{focal!r}" xcr:Skew="0"
       xcr:AspectRatio="1" xcr:PrincipalPointU="{u!r}" xcr:PrincipalPointV="{v!r}"
       xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#">
      <xcr:Rotation>{rotation}</xcr:Rotation>
      <xcr:Position>{position}</xcr:Position>
      <xcr:DistortionCoeficients>{lens}</xcr:DistortionCoeficients>
    </rdf:Description>
  </rdf:RDF>
</x:xmpmeta>
"""


def _realityscan_lens(camera: Camera) -> tuple[float, ...]:
    """Return k1, k2, k3, k4, t1, t2."""
    k1, k2, p1, p2, k3 = _brown(camera)
    return k1, k2, k3, 0.0, p2, p1


def write_xmp(folder: Path, views: Sequence[View]) -> None:
    for view in views:
        camera = view.camera
        side = max(camera.width, camera.height)
        text = _XMP.format(
            focal=camera.fx / side * 36,
            u=(camera.cx - camera.width / 2) / side,
            v=(camera.cy - camera.height / 2) / side,
            rotation=" ".join(map(repr, view.cam_from_world[:, :3].ravel().tolist())),
            position=" ".join(map(repr, view.centre.tolist())),
            lens=" ".join(map(repr, _realityscan_lens(camera))),
        )
        (folder / f"{Path(view.name).stem}.xmp").write_text(text, "utf-8")


def write_csv(folder: Path, views: Sequence[View]) -> None:
    lines = [f"#cameras {len(views)}"]
    lines.append("#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2")
    for view in views:
        pose, camera = _world_from_cam(view, opengl=True), view.camera
        side = max(camera.width, camera.height)
        heading, pitch, roll = Rotation.from_matrix(pose[:, :3]).as_euler("ZXY", degrees=True)
        middle = [
            36 * (camera.cx - camera.width / 2) / side,
            36 * (camera.cy - camera.height / 2) / side,
        ]
        row = [*pose[:, 3], -heading, pitch, roll, camera.fx / side * 36, *middle]
        row += _realityscan_lens(camera)
        lines.append(",".join([view.name, *(repr(float(x)) for x in row)]))
    (folder / "cameras.csv").write_text("\n".join(lines) + "\n", "utf-8")


def write_metashape(folder: Path, views: Sequence[View]) -> None:
    sensors, cameras = [], []
    for number, view in enumerate(views):
        camera = view.camera
        k1, k2, p1, p2, k3 = _brown(camera)
        lens = {"k1": k1, "k2": k2, "k3": k3, "p1": p2, "p2": p1, "b1": camera.fx - camera.fy}
        values = "".join(f"<{name}>{value!r}</{name}>" for name, value in lens.items())
        sensors.append(
            f'<sensor id="{number}" label="phone" type="frame">'
            f'<resolution width="{camera.width}" height="{camera.height}"/>'
            f'<calibration type="frame" class="adjusted"><f>{camera.fy!r}</f>{values}'
            f"<cx>{camera.cx - camera.width / 2!r}</cx>"
            f"<cy>{camera.cy - camera.height / 2!r}</cy></calibration></sensor>"
        )
        matrix = np.vstack([_world_from_cam(view, opengl=False), [0, 0, 0, 1]])
        values = " ".join(map(repr, matrix.ravel().tolist()))
        cameras.append(
            f'<camera id="{number}" sensor_id="{number}" label="{Path(view.name).stem}">'
            f"<transform>{values}</transform></camera>"
        )
    cameras.append('<camera id="99" sensor_id="0" label="not-aligned"></camera>')
    text = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<document version="2.0.0">'
        f'<chunk label="Chunk 1"><sensors>{"".join(sensors)}</sensors>'
        f"<cameras>{''.join(cameras)}</cameras></chunk></document>"
    )
    (folder / "cameras.xml").write_text(text, "utf-8")


WRITERS: dict[str, Callable[[Path, Sequence[View]], None]] = {
    "polycam": write_polycam,
    "record3d": write_record3d,
    "nerfstudio": write_nerfstudio,
    "colmap": write_colmap,
    "realityscan-xmp": write_xmp,
    "realityscan-csv": write_csv,
    "metashape": write_metashape,
}


def view_at(name: str, angles: Sequence[float], centre: Sequence[float], focal: float) -> View:
    """Return a view by the Euler angles (degrees) of camera from world."""
    rotation = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    camera = Camera("PINHOLE", *SIZE, (focal, focal, SIZE[0] / 2, SIZE[1] / 2))
    return View(name, camera, np.column_stack([rotation, -rotation @ np.array(centre)]))
