"""Text with a byte-order mark or in UTF-16, as editors on Windows write it, by every reader."""

from __future__ import annotations

import codecs
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo.core.files import read_json, read_toml
from walltopo.core.text_files import as_utf8, first_text, read_text
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.coco_import import read_coco
from walltopo.scans.colmap_model import read_views

ENCODED: dict[str, Callable[[str], bytes]] = {
    "utf-8": lambda text: text.encode(),
    "utf-8 with a mark": lambda text: codecs.BOM_UTF8 + text.encode(),
    "utf-16-le": lambda text: codecs.BOM_UTF16_LE + text.encode("utf-16-le"),
    "utf-16-be": lambda text: codecs.BOM_UTF16_BE + text.encode("utf-16-be"),
    "utf-16-le without a mark": lambda text: text.encode("utf-16-le"),
    "utf-16-be without a mark": lambda text: text.encode("utf-16-be"),
    "utf-32": lambda text: codecs.BOM_UTF32_LE + text.encode("utf-32-le"),
}
encoded = pytest.mark.parametrize("encode", ENCODED.values(), ids=ENCODED)


@encoded
@given(first=st.characters(min_codepoint=33, max_codepoint=126), rest=st.text(max_size=20))
def test_any_text_is_the_same_in_each_encoding(
    encode: Callable[[str], bytes], first: str, rest: str
) -> None:
    if rest.startswith("\0"):  # which no text format has
        return
    assert as_utf8(encode(first + rest)).decode() == first + rest


@encoded
def test_json_and_toml(encode: Callable[[str], bytes], tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(encode('{"wall": "Höhe"}'))
    assert read_json(tmp_path / "a.json") == {"wall": "Höhe"}
    (tmp_path / "a.toml").write_bytes(encode('wall = "Höhe"\n'))
    assert read_toml(tmp_path / "a.toml") == {"wall": "Höhe"}
    coco: dict[str, list[object]] = {"images": [], "categories": [], "annotations": []}
    (tmp_path / "coco.json").write_bytes(encode(json.dumps(coco)))
    assert not read_coco(tmp_path / "coco.json").masks


_OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
_OFF = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
_PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
_STL = (
    "solid wall\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid wall\n"
)


def gltf() -> str:
    import trimesh

    mesh = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)
    table = json.loads(mesh.export(file_type="gltf")["model.gltf"])
    import base64

    content = mesh.export(file_type="gltf")
    for entry in table["buffers"]:
        packed = base64.b64encode(content[entry["uri"]]).decode()
        entry["uri"] = f"data:application/octet-stream;base64,{packed}"
    return json.dumps(table)


@encoded
@pytest.mark.parametrize("suffix", ["obj", "off", "ply", "stl", "gltf"])
def test_meshes(suffix: str, encode: Callable[[str], bytes], tmp_path: Path) -> None:
    text = {"obj": _OBJ, "off": _OFF, "ply": _PLY, "stl": _STL}.get(suffix) or gltf()
    (tmp_path / f"a.{suffix}").write_bytes(encode(text))
    mesh = read_mesh(tmp_path / f"a.{suffix}")
    assert len(mesh.faces) == 1
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [1, 1, 0])


@encoded
def test_a_colmap_model(encode: Callable[[str], bytes], tmp_path: Path) -> None:
    texts = {
        "cameras": "1 PINHOLE 640 480 500 500 320 240\n",
        "images": "1 1 0 0 0 0 0 0 1 a.jpg\n\n",
        "points3D": "\n",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.txt").write_bytes(encode(text))
    (view,) = read_views(tmp_path)
    assert (view.name, view.camera.width) == ("a.jpg", 640)


def test_damaged_text_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(codecs.BOM_UTF16_LE + b"a\0b")
    with pytest.raises(InputError, match=r"a\.txt: not valid UTF-16"):
        read_text(path)
    path.write_bytes(b"caf\xe9")
    with pytest.raises(InputError, match=r"a\.txt: not text in UTF-8"):
        read_text(path)
    assert first_text(tmp_path / "none.txt", 10) == ""
