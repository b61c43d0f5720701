"""Other formats, crops and merging."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from walltopo.core import InputError
from walltopo.geometry.mesh_files import read_mesh
from walltopo.publish.convert import FORMATS, convert, crop_route
from walltopo.publish.files.meshes import instance_colours
from walltopo.publish.merge import join_textures, merge_walls
from walltopo.publish.wall_data import WallModel, keep_faces, read_wall
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]


@pytest.fixture
def scan(make_scan: MakeScan) -> ScanFolder:
    return make_scan(cells=60)


@pytest.fixture
def wall(scan: ScanFolder) -> WallModel:
    return read_wall(scan)


# `tactile` needs a single route (`test_tactile.py`), `labelme` the photos.
@pytest.mark.parametrize("kind", [kind for kind in FORMATS if kind not in ("labelme", "tactile")])
def test_every_format_is_written(wall: WallModel, tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"wall{FORMATS[kind]}"
    convert(wall, kind, path)
    assert path.stat().st_size > 1000


def test_unknown_format(wall: WallModel, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected one of glb"):
        convert(wall, "docx", tmp_path / "wall.docx")


def test_obj_has_a_group_a_hold(wall: WallModel, tmp_path: Path) -> None:
    convert(wall, "obj", tmp_path / "wall.obj")
    lines = (tmp_path / "wall.obj").read_text().splitlines()
    groups = [line for line in lines if line.startswith("g ")]
    assert groups == ["g wall", *(f"g hold_{k}" for k in range(1, 13))]
    assert sum(line.startswith("f ") for line in lines) == len(wall.mesh.faces)
    assert (tmp_path / "wall.jpg").is_file()


def test_labelled_ply_keeps_faces_in_order(wall: WallModel, tmp_path: Path) -> None:
    import trimesh

    convert(wall, "ply", tmp_path / "wall.ply")
    loaded = trimesh.load(tmp_path / "wall.ply", process=False)
    raw = loaded.metadata["_ply_raw"]["face"]["data"]
    np.testing.assert_array_equal(np.asarray(raw["instance"]).ravel(), wall.face_instance)
    np.testing.assert_array_equal(loaded.faces, wall.mesh.faces)


def test_painted_ply_can_be_read_back(wall: WallModel, tmp_path: Path) -> None:
    convert(wall, "painted-ply", tmp_path / "wall.ply")
    mesh = read_mesh(tmp_path / "wall.ply")
    assert mesh.vertex_colours is not None
    listing = json.loads((tmp_path / "wall.colours.json").read_text())["colours"]
    back = {tuple(entry["rgb"]): entry["id"] for entry in listing}
    painted = [back[tuple(colour)] for colour in mesh.vertex_colours[mesh.faces[:, 0]].tolist()]
    np.testing.assert_array_equal(painted, wall.face_instance)


def test_colours_of_thousands_of_ids_differ() -> None:
    colours = instance_colours(list(range(3000)))
    assert len(set(colours.values())) == 3000


def test_csv(wall: WallModel, tmp_path: Path) -> None:
    wall = replace(
        wall, holds=[msgspec.structs.replace(wall.holds[0], type="=1+1"), *wall.holds[1:]]
    )
    convert(wall, "csv", tmp_path / "wall.csv")
    rows = list(csv.DictReader((tmp_path / "wall.csv").open(encoding="utf-8")))
    assert [int(row["id"]) for row in rows] == list(range(1, 13))
    assert rows[0]["type"] == "'=1+1", "a spreadsheet would run it"
    routes = list(csv.DictReader((tmp_path / "wall.routes.csv").open(encoding="utf-8")))
    assert [int(row["id"]) for row in routes] == [route.id for route in wall.routes]
    for row, route in zip(routes, wall.routes, strict=True):
        assert row["holds"] == " ".join(map(str, route.holds))
        assert float(row["length_m"]) == route.length
    own = {row["id"]: row["route_name"] for row in rows}
    assert own[routes[0]["holds"].split()[0]] == routes[0]["name"]


def test_labelme_outlines_lie_on_the_holds(
    scan: ScanFolder, wall: WallModel, tmp_path: Path
) -> None:
    from walltopo.scans.colmap_model import read_views

    convert(wall, "labelme", tmp_path / "labels", scan=scan)
    view = read_views(scan.sparse)[1]
    document = json.loads((tmp_path / "labels" / "IMG_2.json").read_text())
    places = {hold.id: hold.position for hold in wall.holds}
    assert len(document["shapes"]) >= 6
    for shape in document["shapes"]:
        points = np.array(shape["points"])
        if (points < 3).any() or (points > [317, 237]).any():
            continue  # cut by the photo's edge
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        truth = view.project(np.array(places[shape["group_id"]]))
        assert np.linalg.norm(middle - truth) < 3.0


def test_one_route_alone(wall: WallModel) -> None:
    alone = crop_route(wall, 2)
    assert {hold.id for hold in alone.holds} == {4, 5, 6}
    assert [route.id for route in alone.routes] == [2]
    assert set(np.unique(alone.face_instance)) == {0, 4, 5, 6}
    assert 0.1 < len(alone.mesh.faces) / len(wall.mesh.faces) < 0.6
    with pytest.raises(InputError, match="its routes: 1, 2, 3, 4"):
        crop_route(wall, 9)


def _between(wall: WallModel, left: float, right: float) -> WallModel:
    """The stretch of a wall from x = left to x = right, with the holds in it."""
    x = wall.mesh.centroids[:, 0] - wall.mesh.centroids[:, 0].min()
    shown = {
        hold.id for hold in wall.holds if left <= x[wall.face_instance == hold.id].mean() <= right
    }
    own = np.isin(wall.face_instance, list(shown))
    bare = (wall.face_instance == 0) & (x >= left) & (x <= right)
    return keep_faces(wall, own | bare, shown)


def test_newer_replaces_older_where_they_overlap(make_scan: MakeScan, tmp_path: Path) -> None:
    old = _between(read_wall(make_scan("old", cells=60)), 0.0, 4.0)
    new = _between(read_wall(make_scan("new", cells=60)), 2.0, 6.0)
    walls = join_textures([old, new], tmp_path / "joint.png")
    gym = merge_walls(walls, 0.03, "gym")
    # One surface: no area twice, none missing.
    flat = gym.mesh.areas[gym.face_instance == 0].sum()
    alone = read_wall(make_scan("whole", cells=60))
    assert flat == pytest.approx(alone.mesh.areas[alone.face_instance == 0].sum(), rel=0.03)
    assert len(gym.holds) == 12
    assert len({hold.id for hold in gym.holds}) == 12
    assert gym.uv is not None
    assert gym.uv.shape == (len(gym.mesh.faces), 3, 2)
    for hold in gym.holds:
        assert (gym.face_instance == hold.id).any()


def test_merge_refuses_unlike_scans(make_scan: MakeScan) -> None:
    one, two = read_wall(make_scan("a")), read_wall(make_scan("b", metric=False))
    with pytest.raises(InputError, match="in metres"):
        merge_walls([one, two])
    with pytest.raises(InputError, match="two scans"):
        merge_walls([one])
