"""Read the cameras that Metashape exports as XML (File, Export, Export Cameras).

Sources: nerfstudio's `metashape_utils.py`, and "Camera models" in the Metashape user manual. The
`transform` of a camera is world_from_camera with COLMAP's axes, in the frame of its component
before any reference; `cx` and `cy` are offsets from the middle of the photo; Metashape's p1 and p2
have the opposite order of OpenCV's. The unit and the direction are arbitrary.
"""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from walltopo.core import Camera, InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.files import check_name
from walltopo.core.text_files import first_text
from walltopo.reconstruct.poses.export import (
    Export,
    PhotoFiles,
    last_part,
    of_largest_component,
    parse_numbers,
    single_file,
)
from walltopo.reconstruct.poses.xml_files import read_xml
from walltopo.scans.poses import posed_view

# Metashape's k4 is a factor of r^8, p3 and p4 are higher orders of the tangential distortion, and
# b2 is skew: no lens model here has them.
_NOT_READ = re.compile(r"(?!k[1-3]$|p[12]$|b1$)([kpb]\d+|skew)")


def find_poses(path: Path) -> Path | None:
    """Return the XML file at or in a path; None without one.

    Raises
    ------
    InputError : the folder holds several such files.
    """
    if path.is_dir():
        return single_file(
            (file for file in path.glob("*.xml") if _is_export(file)), "cameras of Metashape"
        )
    return path if path.suffix.lower() == ".xml" and _is_export(path) else None


def _is_export(path: Path) -> bool:
    """Return whether the head of a file is that of Metashape's cameras."""
    head = first_text(path, 4000)
    return "<document" in head and "<chunk" in head


def find_photos(poses: Path) -> Path | None:
    """Return the folder of the photos beside the file."""
    folder = poses.with_name("images")
    return folder if folder.is_dir() else None


def read(poses: Path, photos: PhotoFiles) -> Export:
    """Return the poses of a file, without cameras that are not aligned to most others.

    Raises
    ------
    InputError : the file is damaged or lacks a value; the message names the file.
    """
    chunk = read_xml(poses).find("chunk")
    with prefix_errors(poses):
        if chunk is None:
            raise InputError("holds no chunk: not the cameras of Metashape")
        sensors = {str(s.get("id")): s for s in chunk.iterfind("sensors/sensor")}
        cameras: dict[str, Camera] = {}
        found = []
        for entry in chunk.iterfind("cameras//camera"):
            pose = entry.find("transform")
            if pose is None or entry.get("enabled") in ("0", "false"):
                continue
            label, sensor = str(entry.get("label")), str(entry.get("sensor_id"))
            if sensor not in cameras:
                cameras[sensor] = _sensor_camera(sensors.get(sensor), sensor)
            values = np.reshape(parse_numbers(pose.text, 16, f"camera {label}: transform"), (4, 4))
            name = check_name(last_part(label))
            view = posed_view(name, cameras[sensor], values, opengl=False)
            found.append((entry.get("component_id", ""), view))
    return Export(of_largest_component(found))


def _sensor_camera(sensor: ElementTree.Element | None, number: str) -> Camera:
    """Return the adjusted calibration of a sensor, else the first.

    Raises
    ------
    InputError : it lacks a value, or has a lens parameter that is not understood and not zero.
    """
    if sensor is None:
        raise InputError(f"sensor {number} is missing")
    if sensor.get("type", "frame") != "frame":
        raise InputError(
            f"sensor {number} is of the type {sensor.get('type')!r}; only 'frame' is read",
            "Undistort the photos in Metashape, and export both again.",
        )
    found = sensor.findall("calibration")
    adjusted = [one for one in found if one.get("class") == "adjusted"]
    resolution = sensor.find("resolution")
    if not found or resolution is None:
        raise InputError(f"sensor {number} has no calibration")
    calibration = (adjusted or found)[0]

    def value(name: str) -> float:
        text = calibration.findtext(name)
        return 0.0 if text is None else parse_numbers(text, 1, f"sensor {number}: {name}")[0]

    for entry in calibration:
        if _NOT_READ.fullmatch(entry.tag) and value(entry.tag):
            raise InputError(
                f"sensor {number}: the lens parameter {entry.tag} is not understood",
                "Untick it in Metashape's Optimize Cameras, and export again; or undistort the "
                "photos there, and export both.",
            )
    size = f"{resolution.get('width')} {resolution.get('height')}"
    width, height = parse_numbers(size, 2, f"sensor {number}: resolution")
    focal = value("f")
    middle = (width / 2 + value("cx"), height / 2 + value("cy"))
    distortion = (value("k1"), value("k2"), value("p2"), value("p1"), value("k3"), 0.0, 0.0, 0.0)
    params = (focal + value("b1"), focal, *middle, *distortion)
    return Camera("FULL_OPENCV", int(width), int(height), params)
