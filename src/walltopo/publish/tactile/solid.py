"""Closed solids of maps of heights, as STL and 3MF for 3D printers."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import atomic_path

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MM: Final = 1000.0
_TYPES: Final = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"""
_RELATIONS: Final = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0"
 Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""
_MODEL: Final = """<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources><object id="1" type="model"><mesh><vertices>
{vertices}
</vertices><triangles>
{triangles}
</triangles></mesh></object></resources>
<build><item objectid="1"/></build>
</model>
"""


def solid_of(heights: Floats, pitch: float) -> tuple[Floats, Ints]:
    """Return the closed solid below a map of heights: (V, 3) vertices, m, and (F, 3) triangles.

    Parameters
    ----------
    heights : (H, W) m, > 0; the first row is at the largest y. pitch : m between heights.
    """
    rows, columns = heights.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    x, y = np.meshgrid(np.arange(columns) * pitch, np.arange(rows)[::-1] * pitch)
    top = np.column_stack([x.ravel(), y.ravel(), heights.ravel()])
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[:-1, 1:], index[1:, 1:]
    upper = np.concatenate(
        [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (c, b, d))]
    )
    rim = np.concatenate(
        [index[-1, :-1], index[1:, -1][::-1], index[0, 1:][::-1], index[:-1, 0]]
    )  # counter-clockwise from above
    below = top[rim] * [1, 1, 0]
    middle = np.array([[x.mean(), y.mean(), 0.0]])
    first = len(top)
    low = first + np.arange(len(rim))
    following, high = np.roll(low, -1), np.roll(rim, -1)
    centre = np.full(len(rim), first + len(rim))
    sides = [
        np.column_stack([low, following, high]),
        np.column_stack([low, high, rim]),
        np.column_stack([centre, following, low]),
    ]
    return np.concatenate([top, below, middle]), np.concatenate([upper, *sides])


def write_stl(path: Path, vertices: Floats, faces: Ints) -> None:
    """Write a binary STL in millimetres, as printers expect."""
    corners = (vertices * _MM)[faces].astype("<f4")
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    rows = np.zeros(
        len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")]
    )
    rows["normal"], rows["corners"] = normals / np.maximum(lengths, 1e-20), corners
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        stream.write(b"walltopo, millimetres".ljust(80, b" "))
        stream.write(np.array(len(faces), "<u4").tobytes())
        stream.write(rows.tobytes())


def write_3mf(path: Path, vertices: Floats, faces: Ints) -> None:
    """Write a 3MF (core specification 1.3) with one object, in millimetres."""
    places = "\n".join(
        f'<vertex x="{x:.4g}" y="{y:.4g}" z="{z:.4g}"/>' for x, y, z in (vertices * _MM).tolist()
    )
    triangles = "\n".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces.tolist())
    model = _MODEL.format(vertices=places, triangles=triangles)
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as z:
        z.writestr("[Content_Types].xml", _TYPES)
        z.writestr("_rels/.rels", _RELATIONS)
        z.writestr("3D/3dmodel.model", model)
