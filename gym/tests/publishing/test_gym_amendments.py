"""Amendments: a published wall is corrected without photos, and its routes stay the same."""

from __future__ import annotations

import json
from typing import Any
from uuid import UUID, uuid4

import msgspec
import pytest
from gym.tests.publishing.test_gym_publish import HOLDS, current, draft
from gym.tests.worlds import World
from sqlalchemy import select, update

from walltopo.scans.edits import EditLog
from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.clock import now
from walltopo_gym.scans.models import Scan, ScanEdits
from walltopo_gym.storage.files import FileStore

__all__ = ["current"]

Current = tuple[World, dict[str, Any]]


def amend(world: World) -> dict[str, Any]:
    path = f"{world.path}/walls/{world.wall.id}/amendments"
    answer = world.server.ask("POST", path, world.people["setter"])
    assert answer.status_code == 201, answer.text
    payload: dict[str, Any] = answer.json()
    return payload


def discard(world: World, scan: object) -> Any:
    return world.server.ask("POST", f"{world.path}/scans/{scan}/discard", world.people["setter"])


def kept(table: dict[str, Any]) -> list[dict[str, Any]]:
    return [{"number": line["number"], "route_id": line["route_id"]} for line in table["lines"]]


def test_an_amendment_keeps_routes_and_their_ascents(current: Current) -> None:
    world, before = current
    route = before["routes"][0]["id"]
    tick = {"kind": "top", "tries": 1, "climbed_at": now().isoformat(), "route_id": route}
    ascent = f"{world.path}/ascents/{uuid4()}"
    assert world.server.ask("PUT", ascent, world.people["member"], tick).is_success
    amendment = amend(world)
    assert (amendment["state"], amendment["amends_id"]) == ("review", before["scan_id"])
    assert amend(world)["id"] == amendment["id"]  # a second tap
    with world.server.database.reading() as session:
        logged = select(AuditEntry.subject).where(AuditEntry.action == "scan.amend")
        assert session.scalars(logged).all() == [amendment["id"]]
    table = draft(world, amendment["id"])
    assert {line["fate"] for line in table["lines"]} == {"kept"}
    published = world.publish(amendment["id"], *kept(table), revision=table["revision"])
    assert published.status_code == 200
    after = world.published()
    assert after["scan_id"] == amendment["id"]
    assert [r["id"] for r in after["routes"]] == [r["id"] for r in before["routes"]]
    history = f"{world.path}/routes/{route}/history"
    story = world.server.ask("GET", history, world.people["member"]).json()
    assert story["tally"]["climbers"] == 1
    assert amend(world)["id"] != amendment["id"]  # of the new version


def test_an_amendment_continues_the_edit_log(current: Current) -> None:
    world, before = current
    log = json.loads(msgspec.json.encode(EditLog()))
    with world.server.database.writing() as session:
        scan = UUID(before["scan_id"])
        session.add(ScanEdits(scan_id=scan, revision=3, shown=3, log=log))
    amendment = amend(world)["id"]
    with world.server.database.reading() as session:
        row = session.get_one(ScanEdits, UUID(amendment))
        assert (row.revision, row.shown, row.log) == (3, 3, log)
    store = world.server.services.store
    copied, theirs = store.keys(f"scans/{amendment}/"), store.keys(f"scans/{scan}/")
    assert [key.split("/", 2)[2] for key in copied] == [key.split("/", 2)[2] for key in theirs]
    store.put(copied[0], b"changed")
    assert store.read(theirs[0]) != b"changed"


def test_an_amendment_of_a_former_version_is_not_published(current: Current) -> None:
    world, _ = current
    amendment = amend(world)["id"]
    assert world.publish(world.reviewed({1: [1]}, HOLDS[:1]), {"number": 1}, revision=1).is_success
    refused = world.publish(amendment, {"number": 1}, revision=2)
    assert (refused.status_code, refused.json()["code"]) == (409, "amendment-outdated")
    assert discard(world, amendment).json()["state"] == "cancelled"
    assert discard(world, amendment).status_code == 409


def test_a_planned_scan_is_not_discarded(current: Current) -> None:
    world, _ = current
    amendment = amend(world)["id"]
    table = draft(world, amendment)
    plan = {"revision": table["revision"], "routes": kept(table), "at": "2199-01-01T06:00:00Z"}
    path = f"{world.path}/scans/{amendment}/plan"
    assert world.server.ask("PUT", path, world.people["setter"], plan).is_success
    assert discard(world, amendment).json()["code"] == "plan-first"


def test_a_wall_without_a_version_has_no_amendment(world: World) -> None:
    path = f"{world.path}/walls/{world.wall.id}/amendments"
    answer = world.server.ask("POST", path, world.people["setter"])
    assert answer.json()["code"] == "nothing-published"


def test_an_interrupted_amendment_is_completed(
    current: Current, monkeypatch: pytest.MonkeyPatch
) -> None:
    world, before = current
    with monkeypatch.context() as broken:

        def fail(*_: object) -> None:
            raise OSError("killed")

        broken.setattr(FileStore, "copy_below", fail)
        path = f"{world.path}/walls/{world.wall.id}/amendments"
        assert world.server.ask("POST", path, world.people["setter"]).status_code >= 500
    with world.server.database.reading() as session:
        scans = session.scalars(select(Scan).where(Scan.wall_id == world.wall.id))
        states = {str(row.id): row.state for row in scans}
    assert sorted(states.values()) == ["published", "uploading"]
    amendment = amend(world)
    assert states[amendment["id"]] == "uploading"
    assert amendment["state"] == "review"
    assert len(draft(world, amendment["id"])["lines"]) == len(before["routes"])


def test_an_amendment_that_another_request_published_stays_published(
    current: Current, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two requests copy its files at once; the slower one finds it completed."""
    world, _ = current
    copy_below = FileStore.copy_below
    done: list[str] = []

    def overtaken(store: FileStore, prefix: str, target: str) -> None:
        copy_below(store, prefix, target)
        if not done:
            done.append(target)
            amendment = amend(world)
            moved = update(Scan).where(Scan.id == UUID(amendment["id"]))
            with world.server.database.writing() as session:
                session.execute(moved.values(state="published"))

    monkeypatch.setattr(FileStore, "copy_below", overtaken)
    answer = world.server.ask(
        "POST", f"{world.path}/walls/{world.wall.id}/amendments", world.people["setter"]
    )
    assert answer.json()["state"] == "published"
