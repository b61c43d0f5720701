"""Write USDZ for AR on Apple devices: metres, y up, one mesh, one material, embedded texture.

The stage is written in USD's text form, which readers of USDZ accept like the binary one, so that
no USD library is needed. The archive is a zip whose files are stored uncompressed and begin at
multiples of 64 bytes.
Source: Pixar, "Usdz File Format Specification", version 1.3.
"""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import atomic_path
from walltopo.core.instances import triangles_of
from walltopo.images.colour import linear_from_srgb8
from walltopo.publish.surface import Surface

STAGE, PICTURE = "wall.usda", "textures/wall.jpg"
ALIGNMENT = 64
PADDING_FIELD = 0x1986  # id of the extra field that the reference implementation uses for padding

HEADER = """#usda 1.0
(
    defaultPrim = "Wall"
    doc = "a climbing wall, by walltopo"
    metersPerUnit = 1
    upAxis = "Y"
)

def Xform "Wall" (
    kind = "component"
)
{
    def Mesh "Surface" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        uniform token subdivisionScheme = "none"
        uniform bool doubleSided = 1
        rel material:binding = </Wall/Look>
"""
MATERIAL = """    def Material "Look"
    {
        token outputs:surface.connect = </Wall/Look/Shader.outputs:surface>

        def Shader "Shader"
        {
            uniform token info:id = "UsdPreviewSurface"
            %s
            float inputs:roughness = 1
            float inputs:metallic = 0
            token outputs:surface
        }
%s    }
"""
TEXTURE = f"""
        def Shader "Place"
        {{
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }}

        def Shader "Picture"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @{PICTURE}@
            token inputs:sourceColorSpace = "sRGB"
            token inputs:wrapS = "clamp"
            token inputs:wrapT = "clamp"
            float2 inputs:st.connect = </Wall/Look/Place.outputs:result>
            float3 outputs:rgb
        }}
"""
COLOURS = """
        def Shader "Colours"
        {
            uniform token info:id = "UsdPrimvarReader_float3"
            string inputs:varname = "displayColor"
            float3 outputs:result
        }
"""


def _usd_tuples(values: NDArray[Any], digits: int) -> str:
    """Return (n, k) numbers as a USD array of tuples."""
    row = "(" + ", ".join([f"%.{digits}g"] * values.shape[1]) + ")"
    return "[" + ", ".join([row % tuple(line) for line in values.tolist()]) + "]"


def _whole(values: Iterable[int]) -> str:
    return "[" + ", ".join(map(str, values)) + "]"


def _y_up(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)


def _hold_subsets(surface: Surface) -> Iterator[str]:
    """Yield a named group of faces per hold."""
    label = surface.feature[surface.triangles[:, 0]]
    yield '        uniform token subsetFamily:holds:familyType = "nonOverlapping"\n'
    for id_, rows in triangles_of(label, np.unique(label[label > 0])):
        yield f"""
        def GeomSubset "hold_{id_}"
        {{
            uniform token elementType = "face"
            uniform token familyName = "holds"
            int[] indices = {_whole(rows.tolist())}
        }}
"""


def _stage(surface: Surface, textured: bool) -> str:
    points = _y_up(surface.positions)
    low, high = points.min(axis=0), points.max(axis=0)
    vertex = '(\n            interpolation = "vertex"\n        )\n'
    pad = "        "
    parts = [
        HEADER,
        f"{pad}float3[] extent = {_usd_tuples(np.stack([low, high]), 7)}\n",
        f"{pad}int[] faceVertexCounts = {_whole([3] * len(surface.triangles))}\n",
        f"{pad}int[] faceVertexIndices = {_whole(surface.triangles.ravel().tolist())}\n",
        f"{pad}point3f[] points = {_usd_tuples(points, 6)}\n",
        f"{pad}normal3f[] normals = {_usd_tuples(_y_up(surface.normals), 3)} {vertex}",
    ]
    shading = ("color3f inputs:diffuseColor = (0.62, 0.62, 0.62)", "")
    if surface.uv is not None and textured:
        flipped = np.stack([surface.uv[:, 0], 1 - surface.uv[:, 1]], axis=1)
        parts.append(f"{pad}texCoord2f[] primvars:st = {_usd_tuples(flipped, 5)} {vertex}")
        diffuse = "color3f inputs:diffuseColor.connect = </Wall/Look/Picture.outputs:rgb>"
        shading = (diffuse, TEXTURE)
    elif surface.colours is not None:
        shades = _usd_tuples(linear_from_srgb8(surface.colours), 3)
        parts.append(f"{pad}color3f[] primvars:displayColor = {shades} {vertex}")
        diffuse = "color3f inputs:diffuseColor.connect = </Wall/Look/Colours.outputs:result>"
        shading = (diffuse, COLOURS)
    return "".join([*parts, *_hold_subsets(surface), "    }\n\n", MATERIAL % shading, "}\n"])


def _add_aligned_file(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    """Add one stored file whose bytes begin at a multiple of `ALIGNMENT`."""
    entry = zipfile.ZipInfo(name)  # dated 1980, so that the same wall gives the same bytes
    assert archive.fp is not None
    begin = archive.fp.tell() + 30 + len(name.encode()) + 4
    padding = -begin % ALIGNMENT
    entry.extra = struct.pack("<HH", PADDING_FIELD, padding) + bytes(padding)
    archive.writestr(entry, data)


def write_usdz(path: Path, surface: Surface, picture: bytes | None) -> None:
    """Write a surface and its JPEG texture; each hold is a group of faces, `hold_12`.

    Parameters
    ----------
    surface : world frame, z up; metres, or the units of a scan without a scale.
    picture : the JPEG to which `surface.uv` refers, or None without a texture.
    """
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        _add_aligned_file(archive, STAGE, _stage(surface, picture is not None).encode("ascii"))
        if picture is not None:
            _add_aligned_file(archive, PICTURE, picture)
