"""Meshes of other programs: labels per triangle must fit the file's own order of faces."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from walltopo.core import InputError
from walltopo.geometry.mesh_files import read_mesh, read_mesh_file, write_ply

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]], "<f4")
POLYGONS = [[0, 1, 2, 3], [1, 4, 2], [4, 5, 2], [0, 1, 4, 5, 2]]
TRIANGLES = [
    [0, 1, 2],
    [0, 2, 3],
    [1, 4, 2],
    [4, 5, 2],
    [0, 1, 4],
    [0, 4, 5],
    [0, 5, 2],
]
FILE_FACE = [0, 0, 1, 2, 3, 3, 3]
V = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)


def obj(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def ply(
    path: Path,
    polygons: list[list[int]],
    kind: str = "binary_little_endian",
    flags: list[int] | None = None,
) -> Path:
    """Write a PLY with a number, that of `flags` or 7, before each list, and one after it."""
    flags = flags or [7] * len(polygons)
    head = f"ply\nformat {kind} 1.0\nelement vertex 6\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {len(polygons)}\nproperty uchar flags\n"
    head += "property list uchar int vertex_indices\nproperty float area\nend_header\n"
    if kind == "ascii":
        rows = [" ".join(map(str, row)) for row in CORNERS]
        rows += [
            f"{flag} {len(p)} {' '.join(map(str, p))} 0.5"
            for flag, p in zip(flags, polygons, strict=True)
        ]
        path.write_text(head + "\n".join(rows) + "\n")
        return path
    order = "<" if "little" in kind else ">"
    body = CORNERS.astype(f"{order}f4").tobytes()
    for flag, polygon in zip(flags, polygons, strict=True):
        count = len(polygon)
        body += struct.pack(f"{order}BB{count}if", flag, count, *polygon, 0.5)
    path.write_bytes(head.encode() + body)
    return path


def test_materials_in_turns_keep_the_files_order(tmp_path: Path) -> None:
    text = V + "usemtl a\nf 1 2 3\nusemtl b\nf 2 5 3\nusemtl a\nf 1 3 4\nusemtl b\nf 5 6 3\n"
    found = read_mesh_file(obj(tmp_path / "a.obj", text))
    assert found.mesh.faces.tolist() == [[0, 1, 2], [1, 4, 2], [0, 2, 3], [4, 5, 2]]
    assert found.file_face is None


@pytest.mark.parametrize("corner", ["{}", "{}/1", "{}//1", "{}/1/1"])
def test_polygons_are_split_in_place(tmp_path: Path, corner: str) -> None:
    rows = [" ".join(corner.format(k + 1) for k in polygon) for polygon in POLYGONS]
    text = V + "vt 0 0\nvn 0 0 1\n" + "".join(f"f {row}\n" for row in rows)
    found = read_mesh_file(obj(tmp_path / "a.obj", text))
    assert found.mesh.faces.tolist() == TRIANGLES
    assert found.file_face is not None
    assert found.file_face.tolist() == FILE_FACE


def test_negative_indices_count_from_the_face(tmp_path: Path) -> None:
    lines = V.splitlines()
    text = "\n".join([*lines[:3], "f -3 -2 -1", *lines[3:], "f -3 -2 -1", "f 1 -1 2"])
    assert read_mesh(obj(tmp_path / "a.obj", text)).faces.tolist() == [
        [0, 1, 2],
        [3, 4, 5],
        [0, 5, 1],
    ]


def test_colours_of_vertices_come_along(tmp_path: Path) -> None:
    text = "".join(f"v {x} {y} {z} 1 0.5 0\n" for x, y, z in CORNERS) + "f 1 2 3\n"
    colours = read_mesh(obj(tmp_path / "a.obj", text)).vertex_colours
    assert colours is not None
    assert colours[0].tolist() == [255, 128, 0]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (V + "f 1 2 9\n", r"a\.obj: line 7: a corner that is not one of the 6 vertices"),
        (V + "f 1 2\n", r"a\.obj: line 7: a face of 2"),
        (V + "f 1 2 x\n", r"a\.obj: a face has a corner that is not a number"),
        ("v 0 0 y\n" + V, r"a\.obj: line 1: not a vertex"),
        (V, "no triangles"),
    ],
)
def test_damaged_obj_files_are_named(tmp_path: Path, text: str, named: str) -> None:
    with pytest.raises(InputError, match=named):
        read_mesh(obj(tmp_path / "a.obj", text))


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_mixed_polygons_of_a_ply_are_read(tmp_path: Path, kind: str) -> None:
    found = read_mesh_file(ply(tmp_path / "a.ply", POLYGONS, kind))
    assert found.mesh.faces.tolist() == TRIANGLES
    assert found.file_face is not None
    assert found.file_face.tolist() == FILE_FACE
    np.testing.assert_array_equal(found.mesh.vertices, CORNERS)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_ply_of_triangles_is_read_as_before(tmp_path: Path, kind: str) -> None:
    found = read_mesh_file(ply(tmp_path / "a.ply", POLYGONS[1:3], kind))
    assert found.mesh.faces.tolist() == POLYGONS[1:3]
    assert found.file_face is None
    write_ply(tmp_path / "b.ply", found.mesh)
    assert read_mesh(tmp_path / "b.ply").faces.tolist() == POLYGONS[1:3]


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("polygons", [POLYGONS, POLYGONS[1:3]])
def test_guesses_of_polygons_are_those_of_their_triangles(
    tmp_path: Path, kind: str, polygons: list[list[int]]
) -> None:
    path = ply(tmp_path / "a.ply", polygons, kind, flags=[k % 2 for k in range(len(polygons))])
    path.write_bytes(path.read_bytes().replace(b"uchar flags", b"uchar guessed"))
    expected = [k % 2 == 1 for k, polygon in enumerate(polygons) for _ in polygon[2:]]
    assert (~read_mesh(path).measured).tolist() == expected


@pytest.mark.parametrize("faces", ["3 0 1 2\n3 0 2 3\n", "3 0 1 2\n4 0 2 3 1\n"])
def test_faces_of_a_ply_may_stand_before_its_vertices(tmp_path: Path, faces: str) -> None:
    head = "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\n"
    head += "element vertex 6\n" + "".join(f"property float {axis}\n" for axis in "xyz")
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS)
    path = tmp_path / "a.ply"
    path.write_text(head + "end_header\n" + faces + rows)
    assert read_mesh(path).faces[:2].tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("kind", "red", "expected"), [("float", "0.5", 128), ("int", "7", 7), ("int", "300", None)]
)
def test_colours_of_a_ply_are_bytes(
    tmp_path: Path, kind: str, red: str, expected: int | None
) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 3\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    path = tmp_path / "a.ply"
    path.write_text(
        head + "".join(f"{x} {y} 0 {red} 0 0\n" for x, y, _ in CORNERS[:3]) + "3 0 1 2\n"
    )
    colours = read_mesh(path).vertex_colours
    assert (colours is None) == (expected is None)
    assert colours is None or colours[0].tolist() == [expected, 0, 0]


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_number_before_a_list_is_no_number_of_corners(tmp_path: Path, kind: str) -> None:
    path = ply(tmp_path / "a.ply", [[0, 1], [1, 2]], kind, flags=[3, 3])
    with pytest.raises(InputError, match=r"face 0 has 2 corners"):
        read_mesh(path)


def test_a_cut_ply_is_refused(tmp_path: Path) -> None:
    path = ply(tmp_path / "a.ply", POLYGONS)
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(InputError, match=r"a\.ply: damaged"):
        read_mesh(path)


@pytest.mark.parametrize(
    "extension", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization"]
)
def test_compressed_gltf_is_refused_with_the_remedy(tmp_path: Path, extension: str) -> None:
    document = {"asset": {"version": "2.0"}, "extensionsRequired": [extension]}
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    with pytest.raises(InputError, match=extension) as caught:
        read_mesh(tmp_path / "a.gltf")
    assert "gltf-transform" in caught.value.hint
