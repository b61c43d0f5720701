"""Records and photos against changed rows, deleted walls and repeated requests."""

from __future__ import annotations

import json
from datetime import timedelta
from typing import Any
from uuid import UUID

import pytest
from gym.tests.inspections.rounds import InspectionOf, add_wall, begin, photo, publish_holds
from gym.tests.printed import words_of
from gym.tests.worlds import NOBODY, World

from walltopo_gym.inspections import photos, retention
from walltopo_gym.inspections.models import Inspection
from walltopo_gym.inspections.retention import drop_unnamed_photos
from walltopo_gym.inspections.signing import canonical_text, sign_text


@pytest.fixture
def failed(world: World) -> InspectionOf:
    """A finished inspection with a defect."""
    made = begin(world)
    made.mark(mark="defect", note="torn rope")
    assert made.finish("defects").is_success
    return made


def verified(world: World, made: InspectionOf) -> Any:
    code = made.ask("GET", "/record.json").json()["code"]
    return world.server.ask("GET", f"/inspections/{code}", NOBODY).json()


def test_the_page_shows_what_was_signed(world: World, failed: InspectionOf) -> None:
    with world.server.database.writing() as session:
        session.get_one(Inspection, UUID(failed.id)).result = "passed"
    shown = verified(world, failed)
    assert (shown["result"], shown["is_signed"]) == ("defects", True)


def test_a_record_that_was_signed_anew_has_another_code(world: World, failed: InspectionOf) -> None:
    with world.server.database.writing() as session:
        row = session.get_one(Inspection, UUID(failed.id))
        assert row.finished_by is not None
        row.record = canonical_text(json.loads(row.record) | {"result": "passed", "entries": []})
        row.signature = sign_text(session, row.finished_by, row.record).signature
    assert verified(world, failed)["is_signed"] is False


def test_photos_of_a_record_outlive_its_wall(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    publish_holds(world)
    made = begin(world)
    name = made.send_photo(photo()).json()["photo"]
    made.mark(hold=1, mark="tightened", photo=name)
    assert made.finish().is_success
    wall = f"{world.path}/walls/{world.wall.id}"
    assert world.server.ask("DELETE", wall, world.owner).status_code == 204
    monkeypatch.setattr(retention, "_YOUNG", timedelta())
    drop_unnamed_photos(world.server.settings, world.server.database)
    assert made.ask("GET", f"/photos/{name}").status_code == 200


def test_a_photo_is_sent_again_at_the_limit(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(photos, "_MAX_PHOTOS", 1)
    made = begin(world)
    first = made.send_photo(photo())
    again = made.send_photo(photo())
    assert (again.status_code, again.json()) == (first.status_code, first.json())
    assert made.send_photo(photo((32, 32))).status_code == 409


def test_a_defect_outlives_its_wall(world: World) -> None:
    attic = add_wall(world, "Attic")
    made = begin(world, walls=[str(world.wall.id), attic])
    made.mark(wall_id=attic, mark="defect", note="loose panel")
    address = f"{world.path}/walls/{attic}"
    assert world.server.ask("DELETE", address, world.owner).status_code == 204
    refused = made.finish("passed")
    assert (refused.status_code, refused.json()["code"]) == (422, "inspection-has-defects")
    assert made.finish("defects").is_success
    assert made.mark(wall_id=attic, mark="fine").json()["late"] is True
    record = made.ask("GET", "/record.json").json()["record"]
    assert [wall["name"] for wall in record["walls"]] == ["Attic", world.wall.name]
    assert record["entries"][0]["note"] == "loose panel"
    (listed,) = world.server.ask("GET", f"{world.path}/inspections", world.owner).json()["items"]
    assert listed["walls"] == ["Attic", world.wall.name]
    again = begin(world, walls=[attic], corrects_id=made.id)
    assert again.mark(wall_id=attic, mark="defect", note="it was 2 cm").is_success
    unknown = {"level": "visual", "walls": [attic]}
    refused = world.server.ask("POST", f"{world.path}/inspections", world.owner, unknown)
    assert refused.status_code == 404


def test_late_marks_of_a_hold_outlive_its_wall(world: World) -> None:
    publish_holds(world)
    made = begin(world)
    assert made.finish().is_success
    assert made.mark(hold=1, mark="removed").is_success
    wall = f"{world.path}/walls/{world.wall.id}"
    assert world.server.ask("DELETE", wall, world.owner).status_code == 204
    (late,) = made.ask("GET", "/record.json").json()["late"]
    assert (late["hold"], late["mark"]) == (1, "removed")
    words = words_of(made.ask("GET", "/record.pdf").content)
    assert words.count(world.wall.name) == 3  # in the list, over its marks, beside the late mark
