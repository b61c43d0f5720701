"""A known distance between two points gives a scan its metres; see also test_gym_scan_job.py."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any
from uuid import UUID

import httpx
import pytest
from gym.tests.worlds import World

from walltopo.scans.colmap_model import open_model
from walltopo.scans.folder import ScanFolder
from walltopo_gym.editing.service import EditSessions
from walltopo_gym.scans.distance import distance_settings
from walltopo_gym.scans.models import Scan, ScanEdits

FAR = [[0.0, 0.0, 0.0], [1e5, 1e5, 1e5]]


def give(world: World, scan: UUID, points: Any, metres: float = 2.0) -> httpx.Response:
    path = f"{world.path}/scans/{scan}/distance"
    body = {"points": points, "metres": metres}
    return world.server.ask("POST", path, world.people["setter"], body)


def on_the_wall(folder: Path) -> list[list[float]]:
    """Return two points of a scan's surface."""
    points = open_model(ScanFolder(folder).sparse).points3D.values()
    places = sorted((*map(float, point.xyz),) for point in points)
    return [list(places[len(places) // 4]), list(places[3 * len(places) // 4])]


@pytest.mark.slow
def test_a_distance_queues_the_scan_and_drops_its_edits(world: World, tiny_scan: Path) -> None:
    scan = world.finished(tiny_scan)
    with world.server.database.writing() as session:
        session.add(ScanEdits(scan_id=scan, revision=1, shown=1, log={}))
    points = on_the_wall(tiny_scan)
    for wrong, code in (
        ([points[0], points[0]], "points-the-same"),
        (FAR, "point-not-photographed"),
    ):
        refused = give(world, scan, wrong)
        assert (refused.status_code, refused.json()["code"]) == (422, code)
    assert give(world, scan, points, metres=-1).status_code == 422
    answer = give(world, scan, points)
    assert (answer.status_code, answer.json()["state"]) == (200, "queued"), answer.text
    with world.server.database.reading() as session:
        assert session.get(ScanEdits, scan) is None
        row = session.get_one(Scan, scan)
    assert row.distance is not None
    assert (row.run, row.distance["metres"]) == (1, 2.0)
    assert all(len(marks) >= 2 for marks in row.distance["points"].values())
    assert give(world, scan, points).status_code == 409  # it is on its way


@pytest.mark.slow
def test_the_editor_opens_the_results_of_the_present_run(world: World, tiny_scan: Path) -> None:
    scan, sessions = world.finished(tiny_scan), world.server.services.get(EditSessions)
    first = sessions.of(scan, 0)
    assert sessions.of(scan, 0) is first
    with world.server.database.writing() as session:
        session.get_one(Scan, scan).run = 1
    second = sessions.of(scan, 1)
    assert second is not first
    assert sessions.of(scan, 1) is second
    # Results of the earlier run that come late are dropped.
    with world.server.database.writing() as session:
        session.add(ScanEdits(scan_id=scan, revision=1, shown=0, log={}))
    first._upload_results("1")
    with world.server.database.reading() as session:
        assert session.get_one(ScanEdits, scan).shown == 0
    # So are those of a save after which another server saved.
    with world.server.database.writing() as session:
        session.get_one(ScanEdits, scan).revision = 2
    second._upload_results("1")
    with world.server.database.reading() as session:
        assert session.get_one(ScanEdits, scan).shown == 0
    second._upload_results("2")
    with world.server.database.reading() as session:
        assert session.get_one(ScanEdits, scan).shown == 2


@pytest.mark.slow
def test_a_scan_whose_edits_are_being_applied_is_not_scaled(world: World, tiny_scan: Path) -> None:
    scan = world.finished(tiny_scan)
    with world.server.database.writing() as session:
        session.add(ScanEdits(scan_id=scan, revision=2, shown=1, log={}))
    refused = give(world, scan, on_the_wall(tiny_scan))
    assert (refused.status_code, refused.json()["code"]) == (409, "edits-carried-out")


def test_a_version_of_a_published_wall_keeps_its_scale(world: World) -> None:
    first = world.reviewed({1: [1]}, [])
    second = world.reviewed({1: [1]}, [], reference_id=first)
    refused = give(world, second, FAR)
    assert (refused.status_code, refused.json()["code"]) == (409, "scale-of-reference")


def test_a_photo_that_goes_takes_the_distance_with_it(world: World) -> None:
    scan = world.scan()
    photo = world.photo(scan, state="usable")
    with world.server.database.writing() as session:
        session.get_one(Scan, scan).distance = {"metres": 1.0, "points": {}}
    path = f"{world.path}/photos/{photo}"
    headers = {"tus-resumable": "1.0.0"}
    gone = world.server.ask("DELETE", path, world.people["setter"], headers=headers)
    assert gone.status_code == 204, gone.text
    with world.server.database.reading() as session:
        assert session.get_one(Scan, scan).distance is None


def test_the_pipeline_gets_points_and_distance(tmp_path: Path) -> None:
    marks = {"a": {"0001.jpg": [1.5, 2.0], "0002.jpg": [3.0, 4.0]}, "b": {"0001.jpg": [9.0, 9.5]}}
    words = distance_settings({"metres": 1.25, "points": marks}, tmp_path / "new/points.toml")
    assert words[0] == "scale.method=distance"
    assert words[2] == 'scale.distance="a-b=1.25"'
    assert tomllib.loads((tmp_path / "new/points.toml").read_text()) == marks
