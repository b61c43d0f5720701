"""Arrays and masks of a scan: there and back, and broken ones."""

from __future__ import annotations

import contextlib
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from walltopo.core import InputError, Mask, Mesh
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceTable
from walltopo.scans.pictures import TextureUv

in_one_folder = settings(max_examples=60)
BITMAPS = hnp.arrays(np.bool_, st.tuples(st.integers(1, 12), st.integers(1, 12)))
MASKS = st.builds(
    Mask.from_full, BITMAPS, st.integers(1, 2), st.floats(0, 1, exclude_min=True, width=32)
)


@in_one_folder
@given(
    st.integers(0, 30).flatmap(
        lambda count: st.tuples(
            hnp.arrays(np.int32, count, elements=st.integers(0, 2**31 - 1)),
            hnp.arrays(np.float32, count, elements=st.floats(0, 1, width=32)),
        )
    )
)
def test_instances_there_and_back(
    tmp_path: Path, arrays: tuple[NDArray[np.int32], NDArray[np.float32]]
) -> None:
    InstanceTable(*arrays).save(tmp_path / "i.npz")
    read = InstanceTable.load(tmp_path / "i.npz")
    for before, after in zip(arrays, (read.face_instance, read.face_score), strict=True):
        assert after.dtype == before.dtype
        np.testing.assert_array_equal(after, before)


@pytest.mark.parametrize(
    ("labels", "scores", "named"),
    [
        (np.zeros((3, 2), np.int32), np.zeros((3, 2)), "face_instance"),
        (np.zeros(3, np.int32), np.zeros(4), "face_instance"),
        (np.array([0.5]), np.zeros(1), "face_instance"),
        (np.array([-1]), np.zeros(1), "face_instance"),
        (np.array([2**31]), np.zeros(1), "face_instance"),
        (np.array(["a"]), np.zeros(1), "face_instance"),
        (np.array([1]), np.array([np.nan]), "face_score"),
        (np.array([1]), np.array([1.01]), "face_score"),
        (np.array([1]), np.array(["a"]), "face_score"),
        (np.array([None]), np.zeros(1), "npz"),  # never unpickled
    ],
)
def test_arrays_that_are_no_instances_are_refused(
    tmp_path: Path, labels: NDArray[Any], scores: NDArray[Any], named: str
) -> None:
    np.savez(tmp_path / "i.npz", face_instance=labels, face_score=scores)
    with pytest.raises(InputError, match=rf"i\.npz: .*{named}"):
        InstanceTable.load(tmp_path / "i.npz")


@pytest.mark.parametrize(
    "uv",
    [np.zeros((3, 2)), np.zeros((1, 3, 3)), np.full((1, 3, 2), np.nan), np.zeros((1, 3, 2), int)],
)
def test_arrays_that_are_no_texture_coordinates_are_refused(
    tmp_path: Path, uv: NDArray[Any]
) -> None:
    np.savez(tmp_path / "t.npz", uv=uv)
    with pytest.raises(InputError, match=r"t\.npz: uv"):
        TextureUv.load(tmp_path / "t.npz")
    np.savez(tmp_path / "t.npz", vu=uv)
    with pytest.raises(InputError, match=r"t\.npz: .*uv"):
        TextureUv.load(tmp_path / "t.npz")


def test_tables_of_another_mesh_are_refused() -> None:
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))
    with pytest.raises(InputError, match="triangles"):
        InstanceTable(np.zeros(2, np.int32), np.zeros(2, np.float32)).check_fits(mesh)
    with pytest.raises(InputError, match="triangles"):
        TextureUv(np.zeros((2, 3, 2), np.float32)).check_fits(mesh)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_a_damaged_archive_is_reported_or_harmless(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.npz"
    labels = np.arange(40, dtype=np.int32)
    InstanceTable(labels, np.linspace(0, 1, 40, dtype=np.float32)).save(path)
    content = bytearray(path.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    if data.draw(st.booleans()):
        del content[at:]
    else:
        content[at] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    with contextlib.suppress(InputError):
        np.testing.assert_array_equal(InstanceTable.load(path).face_instance, labels)


@in_one_folder
@given(st.dictionaries(st.text(min_size=1), st.lists(MASKS, max_size=3), max_size=3), st.text())
def test_detections_there_and_back(
    tmp_path: Path, masks: dict[str, list[Mask]], description: str
) -> None:
    sizes = dict.fromkeys(masks, (12, 9))
    given_masks = {name: tuple(items) for name, items in masks.items()}
    written = Detections(given_masks, sizes, {1: "hold", 2: "volume"}, description)
    written.save(tmp_path / "d.json")
    read = Detections.load(tmp_path / "d.json")
    assert (read.sizes, read.classes, read.description) == (sizes, written.classes, description)
    assert list(read.masks) == list(masks)
    for name, items in masks.items():
        for before, after in zip(items, read.masks[name], strict=True):
            np.testing.assert_array_equal(after.full(), before.full())
            assert (after.x, after.y, after.label) == (before.x, before.y, before.label)
            assert after.score == pytest.approx(before.score, abs=1e-4)


@pytest.mark.parametrize(
    "segmentation",
    [
        None,
        5,
        {},
        [["a"] * 6],
        {"size": [8, 10], "counts": "abc"},
        {"size": [8, 10], "counts": "ä"},
        {"size": [8, 10], "counts": 5},
        {"size": [8, 10], "counts": [-1, 81]},
        {"size": [8, 10], "counts": [0, 200]},
        {"size": [8], "counts": [80]},
        {"size": "x", "counts": [1]},
    ],
)
def test_what_is_no_mask_names_the_annotation(tmp_path: Path, segmentation: object) -> None:
    path = tmp_path / "d.json"
    row = {"id": 17, "image_id": 1, "category_id": 1, "segmentation": segmentation}
    data: dict[str, Any] = {
        "images": [{"id": 1, "file_name": "a.jpg", "width": 10, "height": 8}],
        "categories": [{"id": 1, "name": "hold"}],
        "annotations": [row],
    }
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"d\.json: .*annotation(s\[0\]| 17)"):
        Detections.load(path)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"image_id": 2}, "image 2"),
        ({"score": 0.0}, "score"),
        ({"score": 2.0}, "score"),
        ({"category_id": 0}, "category 0"),
        ({"image_id": "1"}, "image_id"),
    ],
)
def test_broken_annotations_are_named(
    tmp_path: Path, change: dict[str, object], named: str
) -> None:
    path = tmp_path / "d.json"
    mask = Mask.from_full(np.eye(5, dtype=np.bool_), 1, 0.5)
    Detections({"a.jpg": (mask,)}, {"a.jpg": (5, 5)}, {1: "hold"}).save(path)
    data = json.loads(path.read_text())
    data["annotations"][0] |= change
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=rf"d\.json: .*annotation.*{named}"):
        Detections.load(path)


@pytest.mark.parametrize("shape", ["(1000000000000,)", "(2, 3)", "(-1,)", "(" * 3000])
def test_arrays_that_claim_more_than_there_is_are_refused(tmp_path: Path, shape: str) -> None:
    text = f"{{'descr': '<i4', 'fortran_order': False, 'shape': {shape}, }}"
    head = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()
    with zipfile.ZipFile(tmp_path / "i.npz", "w") as archive:
        archive.writestr("face_instance.npy", head + bytes(16))
    with pytest.raises(InputError, match=r"i\.npz"):
        InstanceTable.load(tmp_path / "i.npz")


def test_an_archive_that_unpacks_to_gigabytes_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "i.npz", "w") as archive:
        archive.writestr("face_instance.npy", b"\x93NUMPY")
    data = (tmp_path / "i.npz").read_bytes()
    # The directory at the end tells the sizes.
    at = data.index(b"PK\x01\x02") + 24
    (tmp_path / "i.npz").write_bytes(data[:at] + (2**32 - 2).to_bytes(4, "little") + data[at + 4 :])
    with pytest.raises(InputError, match=r"i\.npz: face_instance declares 4294967294 bytes"):
        InstanceTable.load(tmp_path / "i.npz")
