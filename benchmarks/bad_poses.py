"""Poses and meshes of other programs that do not fit the photos, or mean something else."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from benchmarks.bad_pictures import photos_in, scan_of

_Matrix = list[list[float]]

_UPRIGHT: _Matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
_MIRRORED: _Matrix = [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
_SHEARED: _Matrix = [[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
_FAR: _Matrix = [[1, 0, 0, 2e9], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]

Make = Callable[[Path], list[str]]


def _scan(root: Path, *words: str, to: str = "sparse") -> list[str]:
    return scan_of(photos_in(root / "in"), *words, to=to)


def _frames(names: Sequence[str], matrix: _Matrix = _UPRIGHT, **lens: Any) -> str:
    """Return a `transforms.json` of nerfstudio with one pose for all names."""
    camera = {"w": 640, "h": 480, "fl_x": 500, "fl_y": 500, "cx": 320, "cy": 240, **lens}
    frames = [{"file_path": name, "transform_matrix": matrix} for name in names]
    return json.dumps({**camera, "frames": frames})


def _with_poses(file: str, text: str, encoding: str = "utf-8") -> Make:
    """Return a maker of three photos, a file of poses, and the arguments that scan with it."""

    def make(root: Path) -> list[str]:
        poses = root / "poses"
        poses.mkdir()
        (poses / file).write_text(text, encoding)
        return _scan(root, "--poses", str(poses))

    return make


def _nowhere(root: Path) -> list[str]:
    return _scan(root, "--poses", str(root / "poses.json"))


def _mesh_alone(root: Path) -> list[str]:
    return _scan(root, "--mesh", str(root / "wall.obj"), to="dense")


def _import(app: str) -> Make:
    def make(root: Path) -> list[str]:
        return [app, str(photos_in(root / "in")), "--dry-run"]

    return make


_ALL = ("p0.jpg", "p1.jpg", "p2.jpg")
_RECORD3D = {"w": 640, "h": 480, "K": [500, 0, 0, 0, 500, 0, 320, 240, 1]}
_METASHAPE = (
    '<document><chunk><sensors><sensor id="0"><resolution width="640" height="480"/><calibration>'
    "<f>500</f><k4>0.1</k4></calibration></sensor></sensors><cameras>"
    '<camera id="0" sensor_id="0" label="p0"><transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform>'
    "</camera></cameras></chunk></document>"
)
_CSV = "#name,x,y,alt,heading,pitch,roll,f\n"

# Name of the input, its maker, exit code, words of the output, and the command.
POSE_CASES: tuple[tuple[str, Make, int, str, str], ...] = (
    ("`--poses` of nothing", _nowhere, 3, "no such file or folder", "scan"),
    (
        "`--poses` of a folder that holds none",
        _with_poses("notes.txt", "x"),
        3,
        "no camera poses",
        "scan",
    ),
    (
        "poses of other photos",
        _with_poses("transforms.json", _frames(["a.jpg", "b.jpg"])),
        3,
        "none of its 2 poses is of one of the 3 photos",
        "scan",
    ),
    (
        "two poses for one photo",
        _with_poses("transforms.json", _frames([*_ALL, "p0.jpg"])),
        3,
        "a photo named p0.jpg occurs twice",
        "scan",
    ),
    (
        "poses a billion metres away",
        _with_poses("transforms.json", _frames(_ALL, _FAR)),
        3,
        "Expected `float` <= 1000000000.0",
        "scan",
    ),
    (
        "a pose that mirrors",
        _with_poses("transforms.json", _frames(_ALL, _MIRRORED)),
        3,
        "mirrors",
        "scan",
    ),
    (
        "a pose that shears",
        _with_poses("transforms.json", _frames(_ALL, _SHEARED)),
        3,
        "not a rigid transform",
        "scan",
    ),
    (
        "poses of a 360-degree camera",
        _with_poses("transforms.json", _frames(_ALL, camera_model="EQUIRECTANGULAR")),
        3,
        "EQUIRECTANGULAR",
        "scan",
    ),
    (
        "a Record3D pose that is no rotation",
        _with_poses("metadata", json.dumps({**_RECORD3D, "poses": [[0, 0, 0, 0, 1, 2, 3]] * 3})),
        3,
        "is no rotation",
        "scan",
    ),
    (
        "a RealityScan CSV with letters for a number",
        _with_poses("cameras.csv", _CSV + "p0.jpg,1,2,3,north,0,0,26\n"),
        3,
        "cameras.csv",
        "scan",
    ),
    (
        "a `transforms.json` of UTF-16, cut off",
        _with_poses("transforms.json", "\N{BYTE ORDER MARK}{", "utf-16-le"),
        3,
        "not valid JSON",
        "scan",
    ),
    (
        "a RealityScan CSV in Windows' letters",
        _with_poses("cameras.csv", _CSV + "Höhe.jpg,1,2,3,0,0,0,26\n", "cp1252"),
        3,
        "not text in UTF-8",
        "scan",
    ),
    (
        "a lens of Metashape with k4",
        _with_poses("cameras.xml", _METASHAPE),
        3,
        "k4 is not understood",
        "scan",
    ),
    (
        "a lens that folds back within the photo",
        _with_poses("transforms.json", _frames(_ALL, k1=-8)),
        3,
        "folds back",
        "scan",
    ),
    ("`--mesh` without poses", _mesh_alone, 2, "dense.mesh needs sparse.poses", "scan"),
    ("`import polycam` of plain photos", _import("polycam"), 3, "is not the layout of", "import"),
    ("`import auto` of plain photos", _import("auto"), 3, "no camera poses", "import"),
    ("`import scaniverse`", _import("scaniverse"), 3, "is not documented", "import"),
)
