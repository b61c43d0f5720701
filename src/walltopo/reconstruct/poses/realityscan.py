"""Read the cameras of RealityScan (RealityCapture): XMP files beside the photos, or a CSV file.

Sources: "RealityCapture XMP camera math" of its support pages for XMP; nerfstudio's
`realitycapture_utils.py` for the CSV of "Internal/External camera parameters"; AliceVision's
`main_importKnownPoses.cpp` for the order of t1 and t2, which is the opposite of OpenCV's.

XMP: `Rotation` is camera_from_world (row by row) with COLMAP's axes, `Position` the camera's
centre, `FocalLength35mm` is for 36 mm of the longer side, `PrincipalPointU` and `V` are shares of
the longer side from the middle. CSV: heading, pitch and roll turn a camera that looks down the z
axis, as in OpenGL; `f`, `px` and `py` are millimetres for 36 mm of the longer side. The unit and
the direction are arbitrary: RealityScan does not say whether a scale was set.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import prefix_errors
from walltopo.core.files import check_name
from walltopo.core.text_files import first_text, read_text
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

_XCR = "{http://www.capturingreality.com/ns/xcr/1.1#}"
_FILM = 36.0  # millimetres
_COLUMNS = ("x", "y", "alt", "heading", "pitch", "roll", "f")
_LENS = ("k1", "k2", "k3", "k4", "t1", "t2")
_SQUARE = "Undistort the photos in RealityScan, and export both again."
_ALIGN_AGAIN = "Set the distortion model to Brown3 in RealityScan, align and export again."


def find_poses(path: Path) -> Path | None:
    """Return the CSV file or the folder of XMP files at or in a path; None without any.

    Raises
    ------
    InputError : the folder holds several such CSV files.
    """
    if path.is_file():
        return path if _is_table(path) else None
    table = single_file(
        (file for file in path.glob("*.csv") if _is_table(file)), "tables of cameras"
    )
    if table is not None:
        return table
    for folder in (path, path / "images"):
        if any(_is_sidecar(file) for file in folder.glob("*.xmp")):
            return folder
    return None


def find_photos(poses: Path) -> Path | None:
    """Return the folder of the photos: that of the XMP files, or the one beside the table."""
    if poses.is_dir():
        return poses
    folder = poses.with_name("images")
    return folder if folder.is_dir() else poses.parent


def _is_table(path: Path) -> bool:
    if path.suffix.lower() != ".csv":
        return False
    head = first_text(path, 2000)
    return "#name" in head and "heading" in head


def _is_sidecar(path: Path) -> bool:
    return "capturingreality.com" in first_text(path, 4000)


def read(poses: Path, photos: PhotoFiles) -> Export:
    """Return the poses, of the largest component if the XMP files are of several.

    Photos that the scan does not have are left out, as their size is unknown.

    Raises
    ------
    InputError : a file is damaged or lacks a value; the message names the file.
    """
    if poses.is_file():
        return Export(list(_views_of_table(poses, photos)))
    files = sorted(file for file in poses.glob("*.xmp") if _is_sidecar(file))
    found = (_view_of_sidecar(file, photos) for file in files)
    return Export(of_largest_component(one for one in found if one is not None))


def _camera(
    file: Path, photos: PhotoFiles, focal: float, middle: tuple[float, float], lens: list[float]
) -> Camera:
    """Return a camera.

    Parameters
    ----------
    focal, middle : shares of the longer side; `middle` from the middle of the photo.
    lens : k1, k2, k3, k4, t1, t2 of Brown's model.

    Raises
    ------
    InputError : k4 is not zero.
    """
    k1, k2, k3, k4, t1, t2 = lens
    if k4:
        raise InputError("the lens parameter k4 is not understood", _ALIGN_AGAIN)
    width, height = photos.stored_size(file)
    side = max(width, height)
    cx, cy = width / 2 + middle[0] * side, height / 2 + middle[1] * side
    params = (focal * side, focal * side, cx, cy, k1, k2, t2, t1, k3, 0.0, 0.0, 0.0)
    return Camera("FULL_OPENCV", width, height, params)


def _view_of_sidecar(path: Path, photos: PhotoFiles) -> tuple[str, View] | None:
    """Return the component and the view of an XMP file; None without a pose or its photo."""
    photo = photos.find(path.stem)
    if photo is None:
        return None
    root = read_xml(path)
    # Values are attributes or elements of the description, by version.
    values: dict[str, str] = {}
    for item in root.iter():
        values |= {key: text for key, text in item.attrib.items() if key.startswith(_XCR)}
        if item.tag.startswith(_XCR):
            values[item.tag] = item.text or ""

    def row(name: str, count: int, default: str = "") -> list[float]:
        return parse_numbers(values.get(_XCR + name, default), count, name)

    if _XCR + "Rotation" not in values or _XCR + "Position" not in values:
        return None  # only the calibration: the photo was not aligned
    with prefix_errors(path):
        focal = row("FocalLength35mm", 1)[0] / _FILM
        middle = (row("PrincipalPointU", 1, "0")[0], row("PrincipalPointV", 1, "0")[0])
        lens = row("DistortionCoeficients", len(_LENS), "0 0 0 0 0 0")
        model = values.get(_XCR + "DistortionModel", "brown3")
        if any(lens) and not model.startswith("brown"):
            raise InputError(f"the lens model {model!r} is not understood", _ALIGN_AGAIN)
        for name, neutral in (("Skew", 0.0), ("AspectRatio", 1.0)):
            if row(name, 1, str(neutral))[0] != neutral:
                raise InputError(f"{name} is not {neutral:g}, which is not understood", _SQUARE)
        camera = _camera(photo, photos, focal, middle, lens)
        cam_from_world = np.reshape(row("Rotation", 9), (3, 3))
        pose = np.column_stack([cam_from_world.T, row("Position", 3)])
        # Absolute poses are in one frame, others in that of their component.
        is_absolute = values.get(_XCR + "Coordinates", "absolute") == "absolute"
        component = "" if is_absolute else values.get(_XCR + "ComponentId", "")
        return component, posed_view(check_name(photo.name), camera, pose, opengl=False)


def _views_of_table(path: Path, photos: PhotoFiles) -> Iterator[View]:
    lines = read_text(path).splitlines()
    head = next((k for k, line in enumerate(lines) if line.startswith("#name")), None)
    if head is None:
        raise InputError(f"{path}: no line begins with '#name', which names the columns")
    for entry in csv.DictReader(lines[head:]):
        name = str(entry.get("#name"))
        photo = photos.find(name)
        if photo is None:
            continue
        row = _parse_row(entry, f"{path}: {name}")
        middle = (row.get("px", 0.0) / _FILM, row.get("py", 0.0) / _FILM)
        lens = [row.get(key, 0.0) for key in _LENS]
        with prefix_errors(f"{path}: {name}"):
            camera = _camera(photo, photos, row["f"] / _FILM, middle, lens)
            turned = _rotation_of_angles(-row["heading"], row["pitch"], row["roll"])
            pose = np.column_stack([turned, [row["x"], row["y"], row["alt"]]])
            yield posed_view(check_name(last_part(photo.name)), camera, pose, opengl=True)


def _parse_row(entry: Mapping[str, str | None], name: str) -> dict[str, float]:
    """Return the numbers of a line; raise InputError if one is missing or no number."""
    row = {
        key: parse_numbers(text, 1, f"{name}: {key}")[0]
        for key, text in entry.items()
        if key and key != "#name" and text
    }
    lacking = [key for key in _COLUMNS if key not in row]
    if lacking:
        raise InputError(
            f"{name}: lacks {', '.join(lacking)}",
            "Export the registration as 'Internal/External camera parameters'.",
        )
    return row


def _rotation_of_angles(heading_deg: float, pitch_deg: float, roll_deg: float) -> np.ndarray:
    """Return world_from_camera: roll about y, then pitch about x, then heading about z."""
    from scipy.spatial.transform import Rotation

    angles = [heading_deg, pitch_deg, roll_deg]
    return np.asarray(Rotation.from_euler("ZXY", angles, degrees=True).as_matrix())
