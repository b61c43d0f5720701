"""Valid exports of camera poses, one folder for each format, and the reader of all of them."""

from __future__ import annotations

import json
from pathlib import Path

_SIZE = (64, 48)
_XMP = """<x:xmpmeta xmlns:x="adobe:ns:meta/" xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#">
<Description xcr:Coordinates="absolute" xcr:DistortionModel="brown3" xcr:FocalLength35mm="28"
 xcr:PrincipalPointU="0.01" xcr:PrincipalPointV="0" xcr:Skew="0" xcr:AspectRatio="1">
<xcr:Rotation>1 0 0 0 1 0 0 0 1</xcr:Rotation><xcr:Position>1 2 3</xcr:Position>
<xcr:DistortionCoeficients>0.01 0 0 0 0.002 0.001</xcr:DistortionCoeficients>
</Description></x:xmpmeta>
"""
_CSV = """#cameras 2
#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2
a.jpg,1,2,3,10,80,0,28,0.1,0,0.01,0,0,0,0.002,0
b.jpg,2,2,3,20,80,0,28,0.1,0,0.01,0,0,0,0.002,0
"""
_METASHAPE = """<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0"><chunk label="1"><sensors><sensor id="0" type="frame">
<resolution width="64" height="48"/><calibration type="frame" class="adjusted">
<f>60</f><cx>1</cx><cy>0</cy><k1>0.01</k1><p1>0.001</p1><k4>0</k4></calibration></sensor></sensors>
<cameras><camera id="0" sensor_id="0" component_id="0" label="a">
<transform>1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1</transform></camera>
<camera id="1" sensor_id="0" component_id="0" label="b">
<transform>1 0 0 2 0 1 0 2 0 0 1 3 0 0 0 1</transform></camera></cameras></chunk></document>
"""
_IMAGES = "1 1 0 0 0 1 2 3 1 a.jpg\n\n2 1 0 0 0 2 2 3 1 b.jpg\n\n"


def make_poses(root: Path) -> None:
    """Write an export of two posed photos in each format."""
    from PIL import Image

    eye = {f"t_{i}{j}": float(i == j) for i in range(3) for j in range(4)}
    lens = {"fx": 60.0, "fy": 60.0, "cx": 32.0, "cy": 24.0, "width": 64, "height": 48}
    matrix = [[1, 0, 0, 0.5], [0, 1, 0, 2], [0, 0, 1, -1], [0, 0, 0, 1]]
    frames = [{"file_path": f"{k}.jpg", "transform_matrix": matrix} for k in "ab"]
    film = {"w": 64, "h": 48, "K": [60, 0, 0, 0, 60, 0, 32, 24, 1]}
    brown = {"w": 64, "h": 48, "fl_x": 60, "k1": 0.01, "k3": 0.001}
    fisheye = {"camera_model": "OPENCV_FISHEYE", "fl_x": 60}
    files = {
        "polycam": {"keyframes/corrected_cameras/a.json": json.dumps(lens | eye)},
        "record3d": {"metadata": json.dumps({**film, "poses": [[0, 0, 0, 1, 1, 2, 3]] * 2})},
        "nerfstudio": {"transforms.json": json.dumps({**brown, "frames": frames})},
        "fisheye": {"transforms.json": json.dumps({**brown, **fisheye, "frames": frames})},
        "table": {"cameras.csv": _CSV},
        "sidecars": {"a.xmp": _XMP, "b.xmp": _XMP},
        "metashape": {"cameras.xml": _METASHAPE},
        "colmap": {
            "sparse/0/cameras.txt": "1 FOV 64 48 60 60 32 24 0.5\n",
            "sparse/0/images.txt": _IMAGES,
            "sparse/0/points3D.txt": "\n",
        },
    }
    for kind, content in files.items():
        for name, text in content.items():
            path = root / kind / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, "utf-8")
        # Record3D names its photos by number.
        for name in ("0", "1") if kind == "record3d" else ("a", "b"):
            Image.new("RGB", _SIZE).save(root / kind / f"{name}.jpg")


def read_poses_of(folder: Path) -> object:
    """Read the poses as `walltopo scan --poses` does."""
    from walltopo.reconstruct.poses.formats import read_poses
    from walltopo.reconstruct.sparse.given_poses import posed_cameras, posed_views
    from walltopo.scans.photos import Photo

    given = read_poses(folder, sorted(folder.glob("*.jpg")))
    photos = [
        Photo(f"{k}.jpg", *_SIZE, None, one.source, 1.0) for k, one in enumerate(given.photos)
    ]
    views = posed_views(given, photos) if len(photos) > 1 else {}
    return posed_cameras(photos, views)
