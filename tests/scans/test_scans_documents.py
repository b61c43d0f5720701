"""The JSON and TOML files of a scan: there and back, and broken ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from any_value import any_of  # type: ignore[import-not-found]
from hypothesis import given, settings
from msgspec.structs import replace

from walltopo.core import InputError
from walltopo.scans.holds import Hold, Holds, with_routes
from walltopo.scans.instances import InstanceRecords
from walltopo.scans.manifest import Manifest
from walltopo.scans.photos import PhotoList
from walltopo.scans.pictures import CutoutIndex
from walltopo.scans.routes import Route, Routes
from walltopo.scans.scale import Aligned, Scale

DOCUMENTS: list[Any] = [
    Aligned,
    CutoutIndex,
    Holds,
    InstanceRecords,
    Manifest,
    PhotoList,
    Routes,
    Scale,
]
in_one_folder = settings(max_examples=40)
METRES = Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True)


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_there_and_back(kind: Any, tmp_path: Path) -> None:
    @in_one_folder
    @given(any_of(kind))
    def check(value: Any) -> None:
        if kind is Manifest:
            value.version = 1  # newer ones are refused
        value.save(tmp_path / "file")
        assert kind.load(tmp_path / "file") == value

    check()


@given(any_of(Hold))
def test_rounding_is_done_once_and_keeps_what_it_should(hold: Hold) -> None:
    once = hold.rounded()
    assert once.rounded() == once
    assert once.size == pytest.approx(hold.size, abs=5.1e-5)
    assert once.position == pytest.approx(hold.position, abs=5.1e-6)
    exact = ("id", "kind", "type", "colour", "colour_rgb", "photos", "role", "review")
    assert [getattr(once, name) for name in exact] == [getattr(hold, name) for name in exact]


@pytest.mark.parametrize("number", [float("nan"), float("inf"), float("-inf")])
def test_what_is_no_number_is_neither_written_nor_made_a_place(
    tmp_path: Path, number: float
) -> None:
    METRES.save(tmp_path / "scale.json")
    before = (tmp_path / "scale.json").read_bytes()
    with pytest.raises(ValueError, match="JSON"):
        replace(METRES, scale=number).save(tmp_path / "scale.json")
    assert (tmp_path / "scale.json").read_bytes() == before
    with pytest.raises(InputError, match="finite"):
        Hold(7, "hold", position=(0.0, number, 0.0))


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
@pytest.mark.parametrize("kind", DOCUMENTS)
def test_what_is_no_number_is_not_read(kind: Any, number: str, tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    path.write_text(f'{{"scale": {number}}}')
    with pytest.raises(InputError, match=r"file\.json"):
        kind.load(path)


GOOD: dict[Any, dict[str, Any]] = {
    Holds: {"metric": True, "holds": [{"id": 1, "class": "hold"}]},
    InstanceRecords: {
        "classes": {},
        "instances": [
            {"id": 1, "label": 1, "class": "hold", "score": 1, "votes": {}, "views": [], "faces": 1}
        ],
    },
    Manifest: {
        "version": 1,
        "walltopo": "",
        "settings": {},
        "sources": [],
        "stages": {"lift": {"state": "done"}},
    },
    PhotoList: {"photos": []},
    Routes: {"routes": [{"id": 1}]},
    Scale: {"method": "none", "scale": 1, "metric": True, "up_known": True, "floor_known": True},
}
BROKEN: list[tuple[Any, tuple[Any, ...], Any, str]] = [
    (Holds, ("holds", 0, "position"), [0, 0], r"holds\[0\]\.position"),
    (Holds, ("holds", 0, "role"), "boss", r"holds\[0\]\.role"),
    (Holds, ("holds", 0, "colour_rgb"), [0, 0, 0.5], r"holds\[0\]\.colour_rgb"),
    (Holds, ("holds", 0, "type_confidence"), 1.5, "type_confidence"),
    (Holds, ("holds", 0, "class"), None, "class"),
    (Holds, ("holds",), {}, "holds"),
    (InstanceRecords, ("instances", 0, "views"), [["a.jpg"]], r"views\[0\]"),
    (InstanceRecords, ("instances", 0, "id"), "1", r"instances\[0\]\.id"),
    (Manifest, ("stages", "lift", "state"), "asleep", r"stages\[.*\]\.state"),
    (Manifest, ("version",), 99, "newer"),
    (PhotoList, ("photos",), [{"name": "a.jpg"}], r"photos\[0\]"),
    (Routes, ("routes", 0, "holds"), ["1"], r"routes\[0\]\.holds\[0\]"),
    (Scale, ("metric",), "yes", "metric"),
    (Scale, ("metric",), 1, "metric"),
    (Scale, ("plates",), [{}], r"plates\[0\]"),
]


@pytest.mark.parametrize("kind", GOOD)
def test_what_is_broken_below_is_whole_above(kind: Any, tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    path.write_text(json.dumps(GOOD[kind]))
    kind.load(path)


@pytest.mark.parametrize(("kind", "place", "value", "named"), BROKEN)
def test_a_wrong_shape_names_the_file_and_the_place(
    kind: Any, place: tuple[Any, ...], value: Any, named: str, tmp_path: Path
) -> None:
    data: Any = json.loads(json.dumps(GOOD[kind]))
    inner = data
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    path = tmp_path / "file.json"
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=rf"file\.json: .*{named}"):
        kind.load(path)


@pytest.mark.parametrize("kind", DOCUMENTS)
@pytest.mark.parametrize("text", ["[]", "3", "null", "", "{", '{"a": "\\ud800"}', "[" * 100_000])
def test_what_is_no_document_names_the_file(kind: Any, text: str, tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"file\.json"):
        kind.load(path)


def test_keys_of_another_version_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "scale.json"
    METRES.save(path)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"tags": [3]}))
    assert Scale.load(path) == METRES


def test_a_hold_has_the_first_route_that_lists_it() -> None:
    holds = (Hold(2, "hold"), Hold(1, "volume", role="volume"), Hold(3, "hold"))
    routes = (Route(4, holds=(2,)), Route(5, holds=(2, 3)))
    rows = with_routes(holds, routes)
    assert [(row.id, row.kind, row.route) for row in rows] == [
        (1, "volume", None),
        (2, "hold", 4),
        (3, "hold", 5),
    ]
