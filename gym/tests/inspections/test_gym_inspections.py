"""Inspections: the plan, marks of items and holds, the end, and corrections."""

from __future__ import annotations

from datetime import timedelta
from io import BytesIO
from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.inspections.rounds import add_wall, begin, photo, publish_holds, save_plan
from gym.tests.worlds import World, hold, make_world
from PIL import Image
from sqlalchemy import select, update
from tests.at_once import at_once

from walltopo_gym.clock import now
from walltopo_gym.hold_changes.models import HoldChange, HoldComparison
from walltopo_gym.hold_reports.models import HoldReport
from walltopo_gym.inspections import entries, photos, service
from walltopo_gym.inspections.models import Inspection, InspectionEntry
from walltopo_gym.inspections.retention import drop_unnamed_photos
from walltopo_gym.inspections.tables import latest_facts
from walltopo_gym.languages import LANGUAGES
from walltopo_gym.operating.purge import purge
from walltopo_gym.operating.storage_use import measure_storage
from walltopo_gym.scans.quota import used_bytes
from walltopo_gym.storage.pictures import encode_picture


@pytest.fixture
def scan(world: World) -> UUID:
    """A published version with two holds."""
    return publish_holds(world)


def code(answer: Any, status: int = 422) -> str:
    assert answer.status_code == status, answer.text
    found: str = answer.json()["code"]
    return found


def test_the_plan_is_a_proposal_until_an_owner_saves_it(world: World) -> None:
    path = f"{world.path}/inspections/plan"
    plans = [
        world.server.ask("GET", f"{path}?language={language}", world.people["setter"]).json()
        for language in LANGUAGES
    ]
    assert [plan["saved"] for plan in plans] == [False] * 4
    days = [(level["level"], level["interval_days"]) for level in plans[0]["levels"]]
    assert days == [("visual", 1), ("operational", 90), ("annual", 365)]
    for number in range(3):
        lists = [plan["levels"][number]["checklist"] for plan in plans]
        assert len({len(one) for one in lists}) == 1
        assert len({tuple(one) for one in lists}) == 4
    levels = plans[1]["levels"]
    levels[0] |= {"interval_days": 7, "checklist": ["Mats " * 50 + "?"]}
    levels[2]["interval_days"] = None
    assert world.server.ask("PUT", path, world.owner, {"levels": levels}).is_success
    saved = world.server.ask("GET", f"{path}?language=fr", world.owner).json()
    assert saved == {"saved": True, "levels": levels}
    wrong = [levels[0], levels[0], levels[1]]
    assert (
        code(world.server.ask("PUT", path, world.owner, {"levels": wrong})) == "inspection-levels"
    )


def test_an_inspection_keeps_the_checklist_of_its_begin(world: World) -> None:
    made = begin(world, language="de")
    save_plan(world)
    assert made.read()["checklist"] == made.checklist
    assert made.checklist[0].startswith("Matten")
    assert begin(world, language="fr").checklist[0].startswith("Mats")  # of the saved plan


def test_the_latest_mark_counts_and_all_are_kept(world: World, scan: UUID) -> None:
    made = begin(world)
    with world.server.database.writing() as session:
        session.execute(update(Inspection).values(created_at=now() - timedelta(hours=2)))
    first = made.mark("setter", hold=1, mark="washed", note="x" * 300, edit=edit(60))
    assert first.status_code == 201, first.text
    # Made before the setter's mark, without reception; it arrives after it.
    assert made.mark("owner", hold=1, mark="fine", edit=edit(3600)).status_code == 201
    made.mark("owner", item=1, mark="defect", note="a gap of 3 cm")
    marks = [(row["by"], row["hold"], row["mark"]) for row in made.read()["entries"]]
    assert marks == [("owner", 1, "fine"), ("setter", 1, "washed"), ("owner", None, "defect")]
    latest = {(row["hold"], row["mark"]) for row in latest_facts(made.read()["entries"])}
    assert latest == {(1, "washed"), (None, "defect")}


def edit(age_s: float) -> dict[str, Any]:
    return {"device": str(uuid4()), "number": 1, "age_s": age_s}


def test_marks_of_one_phone_keep_their_order_however_they_arrive(world: World, scan: UUID) -> None:
    made, phone = begin(world), str(uuid4())
    with world.server.database.writing() as session:
        session.execute(update(Inspection).values(created_at=now() - timedelta(hours=2)))
    # The third arrives first; by their ages the first would be the latest.
    for number, age_s, mark in ((3, 60.0, "washed"), (1, 59.9, "fine"), (2, 60.1, "tightened")):
        origin = {"device": phone, "number": number, "age_s": age_s}
        assert made.mark(hold=1, mark=mark, edit=origin).status_code == 201
    marks = [row["mark"] for row in made.read()["entries"]]
    assert marks == ["fine", "tightened", "washed"]


def test_a_mark_that_is_sent_twice_is_there_once(world: World, scan: UUID) -> None:
    made, key = begin(world), uuid4()
    statuses = [made.mark(key=key, hold=2).status_code for _ in range(3)]
    assert statuses == [201, 200, 200]
    assert len(made.read()["entries"]) == 1
    assert code(made.mark("owner", key=key, hold=2), 409) == "id-taken"
    assert code(begin(world).mark(key=key, hold=2), 409) == "id-taken"


def test_a_mark_is_of_an_inspected_item_or_hold(world: World, scan: UUID) -> None:
    made = begin(world)
    wrong = {
        "inspection-item-unknown": made.mark(item=len(made.checklist)),
        "inspection-wall-unknown": made.mark(wall_id=add_wall(world, "Attic")),
        "hold-unknown": made.mark(hold=7),
        "inspection-mark-unknown": made.mark(hold=1, mark="defect", note="?"),
        "inspection-defect-note": made.mark(mark="defect"),
        "inspection-photo-unknown": made.mark(photo="0" * 64),
    }
    for wanted, answer in wrong.items():
        assert code(answer) == wanted
    assert code(made.mark(mark="washed")) == "inspection-mark-unknown"
    assert code(made.mark(item=0, hold=1)) == "inspection-mark-unknown"
    assert made.mark(hold=1, mark="cracked").status_code == 422
    assert made.mark(hold=1, note="x" * 301).status_code == 422
    assert made.read()["entries"] == []


def test_no_clock_of_a_phone_moves_a_mark_out_of_its_inspection(world: World, scan: UUID) -> None:
    made = begin(world)
    begun = made.read()["created_at"]
    long_ago = made.mark(hold=1, edit=edit(1e9)).json()["at"]
    assert long_ago == begun
    assert made.mark(hold=1, edit=edit(0)).json()["at"] > begun
    assert made.mark(hold=1, edit=edit(-60)).status_code == 422


def test_an_inspection_has_a_limit_of_entries_walls_and_photos(
    world: World, scan: UUID, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(entries, "MAX_ENTRIES", 1)
    monkeypatch.setattr(photos, "_MAX_PHOTOS", 1)
    made = begin(world)
    assert made.mark().status_code == 201
    assert code(made.mark(), 409) == "inspection-full"
    assert made.send_photo(photo()).status_code == 201
    assert code(made.send_photo(photo((50, 50))), 409) == "inspection-photos"
    path = f"{world.path}/inspections"

    def refused(walls: list[str]) -> Any:
        return world.server.ask("POST", path, world.owner, {"level": "visual", "walls": walls})

    own = str(world.wall.id)
    assert code(refused([own, own])) == "inspection-wall-twice"
    assert refused([]).status_code == 422
    assert refused([str(make_world(world.server, world.people).wall.id)]).status_code == 404
    monkeypatch.setattr(service, "_MAX_OPEN", 1)
    assert code(refused([own]), 409) == "inspections-open"


def test_a_photo_is_reduced_and_has_no_place_and_no_phone(world: World, scan: UUID) -> None:
    made = begin(world)
    name = made.send_photo(photo((3000, 1500), place=True)).json()["photo"]
    stored = made.ask("GET", f"/photos/{name}")
    with Image.open(BytesIO(stored.content)) as image:
        assert image.size == (1280, 640)
        assert not image.getexif()
        assert "comment" not in image.info
    assert made.mark(hold=1, photo=name).json()["photo"] == name
    assert made.ask("GET", f"/photos/{name}", who="member").status_code == 403
    other = begin(world)
    assert code(other.mark(hold=1, photo=name)) == "inspection-photo-unknown"
    assert other.ask("GET", f"/photos/{name}").status_code == 404
    assert made.ask("GET", "/photos/..%2f..%2fgym.toml").status_code in (404, 422)


def test_a_photo_that_is_none_or_too_large_is_refused(world: World) -> None:
    made = begin(world)
    assert code(made.send_photo(b"not a picture")) == "picture-not-one"
    huge = BytesIO()
    Image.new("1", (6000, 5000)).save(huge, "PNG")
    assert code(made.send_photo(huge.getvalue())) == "picture-too-large"
    assert made.send_photo(b"x" * 20_000_000).status_code == 413


def test_pictures_of_all_kinds_lose_their_notes() -> None:
    for kind in ("PNG", "JPEG"):
        made = encode_picture(photo(place=True), 1000, kind)
        with Image.open(BytesIO(made.content)) as image:
            assert not image.getexif()
            assert "comment" not in image.info


def test_photos_that_no_entry_names_go(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    made = begin(world)
    kept, gone = (made.send_photo(photo((n, n))).json()["photo"] for n in (30, 40))
    made.mark(photo=kept)
    tidy = (world.server.settings, world.server.database)
    drop_unnamed_photos(*tidy)
    assert made.ask("GET", f"/photos/{gone}").is_success  # its entry may be waiting
    monkeypatch.setattr("walltopo_gym.inspections.retention._YOUNG", timedelta())
    drop_unnamed_photos(*tidy)
    statuses = [made.ask("GET", f"/photos/{name}").status_code for name in (kept, gone)]
    assert statuses == [200, 404]


def test_a_finished_inspection_never_changes(world: World, scan: UUID) -> None:
    made = begin(world)
    made.mark(hold=1, mark="tightened")
    assert made.finish(remarks="all well\nlight is dim").is_success
    before = made.read()
    assert (before["result"], before["finished_by"]) == ("passed", "setter")
    assert code(made.finish("closed"), 409) == "inspection-finished"
    assert code(made.ask("DELETE"), 409) == "inspection-finished"
    late = made.mark("owner", hold=1, mark="removed", edit=edit(3600))
    assert (late.status_code, late.json()["late"]) == (201, True)
    after = made.read()
    assert after["entries"][-1]["late"]
    assert after["entries"][:-1] == before["entries"]
    signed = ("checklist", "walls", "result", "remarks", "code", "key")
    assert {name: after[name] for name in signed} == {name: before[name] for name in signed}


def test_of_two_ends_one_counts(world: World) -> None:
    made = begin(world)
    answers = at_once(made.finish, lambda: made.finish("closed", "owner"))
    assert sorted(answer.status_code for answer in answers) == [200, 409]


def test_an_inspection_with_a_defect_is_not_passed(world: World) -> None:
    made = begin(world)
    made.mark(mark="defect", note="torn")
    assert code(made.finish()) == "inspection-has-defects"
    made.mark(mark="fine")
    assert made.finish().is_success
    other = begin(world)
    other.mark(mark="defect", note="torn")
    assert other.finish("defects").json()["result"] == "defects"


def test_a_correction_names_the_inspection_that_it_corrects(world: World) -> None:
    made = begin(world)
    path = f"{world.path}/inspections"
    body = {"level": "visual", "walls": [str(world.wall.id)], "corrects_id": made.id}
    assert code(world.server.ask("POST", path, world.owner, body)) == "inspection-corrects"
    made.finish()
    correction = begin(world, corrects_id=made.id)
    assert made.read()["corrected_by"] == [correction.id]
    assert correction.read()["corrects_id"] == made.id
    body["level"] = "annual"
    assert code(world.server.ask("POST", path, world.owner, body)) == "inspection-corrects"
    theirs = make_world(world.server, world.people)
    body = {"level": "visual", "walls": [str(theirs.wall.id)], "corrects_id": made.id}
    assert (
        theirs.server.ask("POST", f"{theirs.path}/inspections", theirs.owner, body).status_code
        == 404
    )


def test_inspections_come_in_pages_and_by_level(world: World) -> None:
    made = [begin(world).id for _ in range(3)]
    begin(world, "annual")
    path, who = f"{world.path}/inspections", world.people["setter"]
    first = world.server.ask("GET", f"{path}?level=visual&size=2", who).json()
    rest = world.server.ask("GET", f"{path}?level=visual&cursor={first['next']}", who).json()
    assert [row["id"] for row in first["items"] + rest["items"]] == made[::-1]
    assert first["items"][0]["walls"] == [world.wall.name]
    assert first["items"][0]["started_by"] == "setter"


def test_a_discarded_inspection_is_gone(world: World) -> None:
    made = begin(world)
    made.mark()
    assert made.ask("DELETE").status_code == 204
    assert made.ask("GET").status_code == 404
    assert made.mark().status_code == 404


def test_a_mark_closes_the_reports_that_were_made_before_it(world: World, scan: UUID) -> None:
    def report(who: str, number: int) -> None:
        body = {"wall_id": str(world.wall.id), "scan_id": str(scan), "hold": number}
        path = f"{world.path}/hold-reports/{uuid4()}"
        body |= {"kind": "spins"}
        assert world.server.ask("PUT", path, world.people[who], body).is_success

    def open_holds() -> list[int]:
        answer = world.server.ask("GET", f"{world.path}/hold-reports", world.people["setter"])
        return sorted(row["hold"] for row in answer.json())

    made = begin(world)
    report("member", 1)
    report("member", 2)
    made.mark(hold=1, mark="fine")
    assert open_holds() == [1, 2]
    with world.server.database.writing() as session:  # an hour ago, all of it
        hour = {"created_at": now() - timedelta(hours=1)}
        session.execute(update(HoldReport).values(hour))
        session.execute(update(Inspection).values(created_at=now() - timedelta(hours=2)))
    report("judge", 1)
    made.mark(hold=1, mark="tightened", edit=edit(600))
    made.mark(hold=2, mark="washed")
    assert open_holds() == [1]  # the judge's is about the tightened hold
    with world.server.database.reading() as session:
        here = select(HoldReport.done_at).where(HoldReport.scan_id == scan)
        assert len([at for at in session.scalars(here) if at is not None]) == 2


def test_the_history_of_a_hold_goes_over_resets(world: World) -> None:
    holds = [hold(n, 0.37 * n, 0.5 + 0.31 * (n % 4)) for n in range(1, 13)]
    first = world.reviewed({1: [1]}, holds)
    assert world.publish(first, {"number": 1}).is_success
    begin(world).mark(hold=3, mark="tightened", note="half a turn")
    body = {"wall_id": str(world.wall.id), "scan_id": str(first), "hold": 3, "kind": "dirty"}
    server, who = world.server, world.people["setter"]
    assert server.ask("PUT", f"{world.path}/hold-reports/{uuid4()}", who, body).is_success
    wash = f"{world.path}/walls/{world.wall.id}/washings"
    assert server.ask("POST", wash, who).is_success
    # The next scan numbers the holds the other way round.
    renumbered = [hold(13 - n, 0.37 * n, 0.5 + 0.31 * (n % 4)) for n in range(1, 13)]
    second = world.reviewed({1: [1]}, renumbered)
    assert world.publish(second, {"number": 1}, revision=1).is_success
    begin(world).mark(hold=10, mark="washed")
    with world.server.database.writing() as session:
        session.merge(HoldComparison(scan_id=second, since_id=first, since=now(), compared=12))
        session.flush()
        session.add(HoldChange(scan_id=second, hold=10, kind="turned", turn_deg=-21.3, moved_m=0.0))
    path = f"{world.path}/walls/{world.wall.id}/versions/{second}/holds/10/history"
    answer = server.ask("GET", path, who)
    assert answer.status_code == 200, answer.text
    assert "21°" in [row["note"] for row in answer.json() if row["kind"] == "turned"]
    kinds = [row["kind"] for row in answer.json() if row["kind"] != "turned"]
    assert kinds == ["washed", "rescanned", "wall-washed", "reported", "tightened", "set"]
    assert server.ask("GET", path, world.people["member"]).status_code == 403
    assert code(server.ask("GET", path.replace("/10/", "/99/"), who)) == "hold-unknown"


def test_a_record_is_kept_for_ten_years(world: World) -> None:
    old, young = begin(world), begin(world)
    for made in (old, young):
        made.mark()
        made.finish()
    with world.server.database.writing() as session:
        past = now() - timedelta(days=3660)
        mine = update(Inspection).where(Inspection.id == UUID(old.id))
        session.execute(mine.values(finished_at=past))
    purge(world.server.settings, world.server.database, world.server.services.store)
    assert [made.ask("GET").status_code for made in (old, young)] == [404, 200]
    with world.server.database.reading() as session:
        gone = select(InspectionEntry).where(InspectionEntry.inspection_id == UUID(old.id))
        assert session.scalar(gone) is None


def test_photos_count_for_the_storage_of_their_gym(world: World) -> None:
    begin(world).send_photo(photo((300, 300)))
    measure_storage(world.server.database, world.server.services.store)
    with world.server.database.reading() as session:
        assert used_bytes(session, [world.gym.id])[world.gym.id] > 0


def test_a_wall_is_closed_until_a_later_inspection(world: World, scan: UUID) -> None:
    other = add_wall(world, "Other")

    def closed(who: str = "member") -> dict[str, bool]:
        walls = world.server.ask("GET", f"{world.path}/walls", world.people[who]).json()
        return {wall["id"]: wall["closed_since"] is not None for wall in walls}

    wall = str(world.wall.id)
    assert closed() == {wall: False, other: False}
    made = begin(world)
    assert closed() == {wall: False, other: False}
    ended = made.finish("closed").json()["finished_at"]
    assert closed() == {wall: True, other: False}
    one = world.server.ask("GET", f"{world.path}/walls/{wall}", world.people["member"]).json()
    assert one["closed_since"] == ended
    # Nobody could end it while inspections are off.
    for off in (["inspections"], []):
        body = {"features_off": off}
        assert world.server.ask("PATCH", world.path, world.owner, body).is_success
        assert closed()[wall] == (not off)
    assert begin(world, walls=[other]).finish("closed").is_success
    assert begin(world).finish("defects").is_success
    assert closed() == {wall: False, other: True}
