"""Mesh files that claim more than they hold, or refer to what is not beside them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from walltopo.core import InputError, Mesh
from walltopo.geometry.mesh_files import read_mesh, write_ply

HEAD = "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n"
HEAD += "property float z\nelement face {faces}\n"
HEAD += "property list uchar int vertex_indices\nend_header\n"
POINTS = "0 0 0\n1 0 0\n0 1 0\n"


def _ascii(tmp_path: Path, body: str, vertices: object = 3, faces: object = 1) -> Path:
    path = tmp_path / "m.ply"
    path.write_text(HEAD.format(format="ascii", vertices=vertices, faces=faces) + body)
    return path


def test_a_whole_one_is_read(tmp_path: Path) -> None:
    assert len(read_mesh(_ascii(tmp_path, POINTS + "3 0 1 2\n")).faces) == 1


@pytest.mark.parametrize("count", ["2000000000", "9" * 40, "-3", "x"])
@pytest.mark.parametrize("which", ["vertices", "faces"])
def test_counts_beyond_the_file_are_refused(tmp_path: Path, count: str, which: str) -> None:
    path = _ascii(tmp_path, POINTS + "3 0 1 2\n", **{which: count})
    with pytest.raises(InputError, match=r"m\.ply: damaged: it declares"):
        read_mesh(path)


@pytest.mark.parametrize(
    "body",
    [
        POINTS + "3 0 1 7\n",
        POINTS + "3 0 1 -1\n",
        "nan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "1e999 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        POINTS,
    ],
)
def test_faces_and_vertices_that_are_none_are_refused(tmp_path: Path, body: str) -> None:
    with pytest.raises(InputError, match=r"m\.ply"):
        read_mesh(_ascii(tmp_path, body))


def test_a_cut_binary_one_is_refused(tmp_path: Path) -> None:
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))
    write_ply(tmp_path / "m.ply", mesh)
    data = (tmp_path / "m.ply").read_bytes()
    for cut in (5, 13, 20):
        (tmp_path / "m.ply").write_bytes(data[:-cut])
        with pytest.raises(InputError, match=r"m\.ply"):
            read_mesh(tmp_path / "m.ply")


def test_an_archive_is_no_mesh(tmp_path: Path) -> None:
    (tmp_path / "m.zip").write_bytes(b"PK")
    with pytest.raises(InputError, match="not a mesh file"):
        read_mesh(tmp_path / "m.zip")


@pytest.mark.parametrize("uri", ["../secret.bin", "/etc/passwd"])
def test_gltf_takes_no_buffer_from_elsewhere(tmp_path: Path, uri: str) -> None:
    import trimesh

    folder = tmp_path / "in"
    folder.mkdir()
    for name, data in trimesh.creation.box().export(file_type="gltf").items():
        (folder / name).write_bytes(data)
    assert len(read_mesh(folder / "model.gltf").faces) == 12
    buffer = sorted(folder.glob("*.bin"))[0]
    text = (folder / "model.gltf").read_text()
    assert buffer.name in text
    (tmp_path / "secret.bin").write_bytes(buffer.read_bytes())
    (folder / "model.gltf").write_text(text.replace(buffer.name, uri))
    with pytest.raises(InputError, match="leads out"):
        read_mesh(folder / "model.gltf")


@pytest.mark.parametrize("count", [2**31, 2**40, 2**63, -1])
@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_counts_of_gltf_beyond_the_file_are_refused(
    tmp_path: Path, suffix: str, count: int
) -> None:
    import trimesh

    made = trimesh.creation.box().export(file_type=suffix)
    files = made if isinstance(made, dict) else {"model.glb": made}
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    path = tmp_path / f"model.{suffix}"
    # GLB tells the length of its JSON: the same number of bytes goes in.
    old = b'"count":36' if b'"count":36' in path.read_bytes() else b'"count": 36'
    data = path.read_bytes()
    assert old in data
    at = data.index(old)
    grown = data.replace(old, f'"count":{count}'.encode(), 1)
    if suffix == "glb":
        more = len(grown) - len(data)
        length = int.from_bytes(data[12:16], "little") + more
        grown = (
            grown[:8] + len(grown).to_bytes(4, "little") + length.to_bytes(4, "little") + grown[16:]
        )
    assert at > 0
    path.write_bytes(grown)
    with pytest.raises(InputError, match=r"declares|JSON"):
        read_mesh(path)
