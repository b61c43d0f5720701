"""Holds that turned, moved, went or came between two versions, though their routes stayed."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import numpy as np
import pytest
from gym.tests.hurried import do_all, forget_jobs
from gym.tests.worlds import Server, World, make_world
from sqlalchemy import select
from tests.describe.matching.wedges import holds_of, save_scan

from walltopo.core.files import files_below
from walltopo.scans.folder import ScanFolder
from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.hold_changes.comparing import (
    COMPARISONS,
    HoldComparisons,
    record_failure,
)
from walltopo_gym.hold_changes.models import HoldChange, HoldComparison
from walltopo_gym.jobs.queue import Task

STILL = np.zeros((4, 2))
SHIFTS = np.array([[0.0, 0.0], [0.0, 0.0], [0.03, -0.01], [0.0, 0.0]])


def task(server: Server) -> Task:
    job = HoldComparisons(server.database, server.services.store)
    return Task(COMPARISONS, job.compare, record_failure)


ROUTES = {1: [1, 2], 2: [3, 4]}


def version(
    world: World,
    folder: Path,
    turns: list[float],
    shifts: Any = STILL,
    routes: dict[int, list[int]] = ROUTES,
    **facts: Any,
) -> UUID:
    """Return a scan in review whose wedges 1 and 2 are route 1, and 3 and 4 route 2."""
    scan = world.reviewed(routes, holds_of(shifts), **facts)
    made = save_scan(folder, turns, shifts)
    for file in files_below(made.root):
        world.server.services.store.put(
            f"scans/{scan}/{file.relative_to(made.root).as_posix()}", file
        )
    return scan


@pytest.fixture
def world(server: Server) -> World:
    forget_jobs(server)
    return make_world(server)


@pytest.fixture
def old(world: World, tmp_path: Path) -> UUID:
    """The first version, with the routes Moon and Sun."""
    scan = version(world, tmp_path / "old", [0.0, 20.0, 0.0, 0.0])
    entries = {"number": 1, "name": "Moon"}, {"number": 2, "name": "Sun"}
    assert world.publish(scan, *entries).is_success
    return scan


def routes_of(world: World) -> dict[str, str]:
    return {route["name"]: route["id"] for route in world.published()["routes"]}


def publish_later(world: World, scan: UUID, *, kept: tuple[str, ...] = ("Moon", "Sun")) -> None:
    """Publish a second version whose routes are those of the first, or new ones."""
    known = routes_of(world)
    numbers = {1: "Moon", 2: "Sun"}
    entries = [
        {"number": number, "route_id": known[name]}
        if name in kept
        else {"number": number, "name": f"{name} II"}
        for number, name in numbers.items()
    ]
    assert world.publish(scan, *entries, revision=1).is_success


def listed(world: World, query: str = "") -> list[dict[str, Any]]:
    answer = world.server.ask("GET", f"{world.path}/hold-changes{query}", world.people["setter"])
    assert answer.status_code == 200, answer.text
    rows: list[dict[str, Any]] = answer.json()
    return rows


def changes(world: World, query: str = "") -> list[dict[str, Any]]:
    (one,) = listed(world, query)
    rows: list[dict[str, Any]] = one["changes"]
    return rows


def test_a_new_version_shows_what_turned_and_moved(world: World, old: UUID, tmp_path: Path) -> None:
    do_all(world.server, task(world.server))
    assert listed(world) == []  # the first version has nothing to be compared with
    new = version(world, tmp_path / "new", [0.0, 45.0, 0.0, 0.0], SHIFTS, reference_id=old)
    publish_later(world, new)
    (one,) = listed(world)
    assert (one["compared"], one["error"], one["changes"]) == (None, "", [])
    do_all(world.server, task(world.server))
    (one,) = listed(world, f"?wall={world.wall.id}")
    assert (one["compared"], one["error"]) == (4, "")
    turned, moved = one["changes"]
    assert (turned["kind"], turned["hold"], turned["route_name"]) == ("turned", 2, "Moon")
    assert turned["turn_deg"] == pytest.approx(25.0, abs=2.0)
    assert (moved["kind"], moved["hold"], moved["route_name"]) == ("moved", 3, "Sun")
    assert moved["moved_m"] == pytest.approx(0.032, abs=0.003)


def test_new_routes_explain_their_holds(world: World, old: UUID, tmp_path: Path) -> None:
    new = version(world, tmp_path / "new", [0.0, 45.0, 0.0, 0.0], SHIFTS, reference_id=old)
    publish_later(world, new, kept=("Sun",))
    do_all(world.server, task(world.server))
    assert [(row["kind"], row["route_name"]) for row in changes(world)] == [("moved", "Sun")]


def test_a_hold_of_two_routes_is_listed_if_one_of_them_stayed(
    world: World, old: UUID, tmp_path: Path
) -> None:
    turns = [0.0, 45.0, 0.0, 0.0]
    both = {1: [1, 2], 2: [2, 3, 4]}
    new = version(world, tmp_path / "new", turns, routes=both, reference_id=old)
    publish_later(world, new, kept=("Moon",))
    do_all(world.server, task(world.server))
    assert [(row["kind"], row["route_name"]) for row in changes(world)] == [("turned", "Moon")]


def test_holds_of_kept_routes_that_went_or_came(world: World, old: UUID, tmp_path: Path) -> None:
    far = np.array([[0.0, 0.0], [0.5, -0.3], [0.0, 0.0], [0.0, 0.0]])
    new = version(world, tmp_path / "new", [0.0, 20.0, 0.0, 0.0], far, reference_id=old)
    publish_later(world, new, kept=("Moon",))
    do_all(world.server, task(world.server))
    found = [(row["kind"], row["hold"], row["route_name"]) for row in changes(world)]
    assert found == [("gone", None, "Moon"), ("new", 2, "Moon")]


def test_versions_in_other_coordinates_are_not_compared(
    world: World, old: UUID, tmp_path: Path
) -> None:
    publish_later(world, version(world, tmp_path / "new", [0.0, 45.0, 0.0, 0.0]))
    assert listed(world) == []


def test_an_amendment_keeps_what_its_version_shows(world: World, old: UUID, tmp_path: Path) -> None:
    turns = [0.0, 45.0, 0.0, 0.0]
    new = version(world, tmp_path / "new", turns, reference_id=old)
    publish_later(world, new)
    do_all(world.server, task(world.server))
    amendment = version(world, tmp_path / "amendment", turns, reference_id=old, amends_id=new)
    known = routes_of(world)
    entries = [{"number": n, "route_id": known[name]} for n, name in ((1, "Moon"), (2, "Sun"))]
    assert world.publish(amendment, *entries, revision=2).is_success
    do_all(world.server, task(world.server))
    assert [row["kind"] for row in changes(world)] == ["turned"]
    with world.server.database.reading() as session:
        assert session.get(HoldComparison, amendment) is None


def test_done_and_undone_are_logged_once(world: World, old: UUID, tmp_path: Path) -> None:
    new = version(world, tmp_path / "new", [0.0, 45.0, 0.0, 0.0], reference_id=old)
    publish_later(world, new)
    do_all(world.server, task(world.server))
    (row,) = changes(world)
    path = f"{world.path}/hold-changes/{row['id']}/done"
    for _ in range(2):
        assert world.server.ask("PUT", path, world.people["setter"]).status_code == 204
    assert changes(world) == []
    (done,) = changes(world, "?done=true")
    assert done["done_at"] is not None
    for _ in range(2):
        assert world.server.ask("DELETE", path, world.people["setter"]).status_code == 204
    assert changes(world) == [row]
    with world.server.database.reading() as session:
        mine = select(AuditEntry.action).where(AuditEntry.gym_id == world.gym.id)
        log = [action for action in session.scalars(mine) if action.startswith("hold-change")]
    assert sorted(log) == ["hold-change.done", "hold-change.open"]


def test_a_comparison_without_files_says_so(world: World, old: UUID, tmp_path: Path) -> None:
    new = version(world, tmp_path / "new", [0.0, 45.0, 0.0, 0.0], reference_id=old)
    texture = ScanFolder("").texture
    world.server.services.store.drop([f"scans/{old}/{texture.as_posix()}"])
    publish_later(world, new)
    do_all(world.server, task(world.server))
    (one,) = listed(world)
    assert (one["compared"], one["error"]) == (
        None,
        "the files of a version are not stored any more",
    )


def test_a_damaged_version_names_the_reason(world: World, old: UUID, tmp_path: Path) -> None:
    new = version(world, tmp_path / "new", [0.0, 45.0, 0.0, 0.0], reference_id=old)
    mesh = ScanFolder("").mesh
    world.server.services.store.put(f"scans/{new}/{mesh.as_posix()}", b"ply\nhalf a")
    publish_later(world, new)
    do_all(world.server, task(world.server))
    (one,) = listed(world)
    assert one["compared"] is None
    assert "mesh.ply" in one["error"]
    assert "/" not in one["error"].partition("mesh.ply")[0]  # no folder of the server


def test_another_gym_has_no_such_change(world: World, old: UUID, tmp_path: Path) -> None:
    new = version(world, tmp_path / "new", [0.0, 45.0, 0.0, 0.0], reference_id=old)
    publish_later(world, new)
    do_all(world.server, task(world.server))
    (row,) = changes(world)
    theirs = make_world(world.server)
    for change in (row["id"], uuid4()):
        path = f"{theirs.path}/hold-changes/{change}/done"
        assert theirs.server.ask("PUT", path, theirs.owner).status_code == 404
    with world.server.database.reading() as session:
        assert session.get_one(HoldChange, UUID(row["id"])).done_at is None
