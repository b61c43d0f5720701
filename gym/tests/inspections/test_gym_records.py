"""Records of finished inspections: signed, verified, printed, exported."""

from __future__ import annotations

import json
from datetime import timedelta
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest
from gym.tests.inspections.rounds import InspectionOf, begin, photo, publish_holds, save_plan
from gym.tests.printed import codes_of, pages_of, words_of
from gym.tests.worlds import NOBODY, ORIGIN, World
from sqlalchemy import update

from walltopo.cli import main
from walltopo_gym.clock import now
from walltopo_gym.inspections import paper
from walltopo_gym.inspections.models import Inspection, InspectionKey
from walltopo_gym.inspections.record import check_file
from walltopo_gym.languages import LANGUAGES
from walltopo_gym.operating.own_data import all_of, delete_account


@pytest.fixture
def ended(world: World) -> InspectionOf:
    """A finished inspection with marks, a photo, and an entry that came later."""
    publish_holds(world)
    made = begin(world)
    name = made.send_photo(photo()).json()["photo"]
    made.mark("owner", hold=1, mark="tightened", note="=half a turn", photo=name)
    made.mark(item=1, mark="defect", note="a gap of 3 cm")
    assert made.finish("defects", remarks="Mats ordered.").is_success
    made.mark("owner", hold=2, mark="removed")
    return made


def file_of(made: InspectionOf) -> bytes:
    answer = made.ask("GET", "/record.json")
    assert answer.status_code == 200, answer.text
    content: bytes = answer.content
    return content


def verified(world: World, code: str) -> Any:
    answer = world.server.ask("GET", f"/inspections/{code}", NOBODY)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_a_record_is_signed_and_any_change_is_found(world: World, ended: InspectionOf) -> None:
    content = file_of(ended)
    found = check_file(content)
    assert found is not None
    assert found.record["finished"]["by"] == "setter"
    assert [entry["mark"] for entry in found.record["entries"]] == ["tightened", "defect"]
    file = json.loads(content)
    changes: list[tuple[str, Any]] = [
        ("result", "passed"),
        ("remarks", ""),
        ("entries", file["record"]["entries"][:1]),
        ("finished", {**file["record"]["finished"], "by": "owner"}),
    ]
    for name, value in changes:
        forged = {**file, "record": {**file["record"], name: value}}
        assert check_file(json.dumps(forged).encode()) is None
    for name in ("signature", "public_key"):
        assert check_file(json.dumps({**file, name: "AAAA"}).encode()) is None
    # The late entry is in the file, and no part of what is signed.
    assert [entry["mark"] for entry in file["late"]] == ["removed"]
    assert check_file(json.dumps({**file, "late": []}).encode()) is not None


def test_a_code_reveals_few_facts_and_no_names(world: World, ended: InspectionOf) -> None:
    code = ended.read()["code"]
    spelled = paper.spaced_code(code).lower().replace("0", "o").replace("1", "l")
    for spelling in (code, spelled):
        facts = verified(world, spelling)
        assert facts["code"] == code
        assert (facts["result"], facts["is_signed"], facts["late"]) == ("defects", True, 1)
        assert facts["key"] == ended.read()["key"]
        assert "setter" not in json.dumps(facts)
    for wrong in ("0" * 16, "x", code[:-1]):
        answer = world.server.ask("GET", f"/inspections/{wrong}", NOBODY)
        assert (answer.status_code, answer.json()["code"]) == (404, "inspection-code-unknown")


def test_a_row_that_was_changed_in_the_database_is_not_verified(
    world: World, ended: InspectionOf
) -> None:
    code = ended.read()["code"]
    mine = update(Inspection).where(Inspection.code == code)
    with world.server.database.writing() as session:
        row = session.get_one(Inspection, UUID(ended.id))
        session.execute(mine.values(record=row.record.replace("defects", "passed")))
    assert verified(world, code)["is_signed"] is False
    assert check_file(file_of(ended)) is None


def test_a_correction_is_shown_where_the_code_is_checked(world: World, ended: InspectionOf) -> None:
    correction = begin(world, corrects_id=ended.id)
    code = ended.read()["code"]
    assert verified(world, code)["corrected_by"] is None
    correction.finish()
    assert verified(world, code)["corrected_by"] == correction.read()["code"]
    printed = words_of(correction.ask("GET", "/record.pdf").content)
    assert paper.spaced_code(code) in printed


def test_everybody_signs_with_a_key_of_their_own(world: World) -> None:
    keys = {}
    for who in ("setter", "owner"):
        rounds = [begin(world), begin(world)]
        keys[who] = {made.finish(who=who).json()["key"] for made in rounds}
    assert [len(names) for names in keys.values()] == [1, 1]
    assert keys["setter"] != keys["owner"]


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_record_is_printed_with_its_code(
    world: World, ended: InspectionOf, language: str
) -> None:
    answer = ended.ask("GET", f"/record.pdf?language={language}")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/pdf"
    words = words_of(answer.content)
    code = ended.read()["code"]
    for text in ("setter", "owner", "a gap of 3 cm", "Mats ordered.", paper.spaced_code(code)):
        assert text in words
    assert codes_of(pages_of(answer.content)[0], 2, 3) == {f"{ORIGIN}/verify/{code}"}
    assert "x-not-printed" not in answer.headers


def test_a_record_with_many_photos_prints_some(
    world: World, ended: InspectionOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(paper, "_MAX_PHOTOS", 0)
    assert "1 more photos" in words_of(ended.ask("GET", "/record.pdf").content)


def test_an_unfinished_inspection_has_no_record(world: World) -> None:
    made = begin(world)
    for kind in ("pdf", "json", "csv"):
        assert made.ask("GET", f"/record.{kind}").status_code == 409


def test_a_table_has_no_formula(world: World, ended: InspectionOf) -> None:
    lines = ended.ask("GET", "/record.csv").text.splitlines()
    assert lines[0].lstrip("\ufeff") == "at,wall,item,hold,mark,note,by,photo,counts,late"
    assert len(lines) == 4
    assert ",'=half a turn,owner," in lines[1]
    assert lines[3].endswith(",removed,,owner,,,yes")


def test_the_record_keeps_the_names_of_deleted_accounts(world: World) -> None:
    made = begin(world)
    made.mark()
    made.finish()
    running = begin(world)
    running.mark()
    setter = world.people["setter"].id
    assert setter is not None
    with world.server.database.writing() as session:
        data = all_of(session, setter)
        assert len(data["inspections"]) == len(data["inspection_entries"]) == 2
        assert "secret" not in data["inspection_keys"][0]
        assert "record" not in data["inspections"][0]  # it names others
        delete_account(session, setter)
    with world.server.database.reading() as session:
        assert session.get(InspectionKey, setter) is None
        row = session.get_one(Inspection, UUID(running.id))
        assert row.person_id is None
    # The record of the gym stays as it was signed; the other inspection names nobody.
    path = f"{world.path}/inspections"
    record = world.server.ask("GET", f"{path}/{made.id}/record.json", world.owner)
    assert check_file(record.content) is not None
    assert record.json()["record"]["finished"]["by"] == "setter"
    other = world.server.ask("GET", f"{path}/{running.id}", world.owner).json()
    assert (other["started_by"], other["entries"][0]["by"]) == ("", "")


def test_an_inspection_is_due_by_its_last_end(world: World) -> None:
    path, who = f"{world.path}/inspections/due", world.people["setter"]
    assert world.server.ask("GET", path, who).json() == []
    save_plan(world, annual=None)

    def due() -> dict[str, bool]:
        found = world.server.ask("GET", path, who).json()
        return {level["level"]: level["walls"][0]["is_due"] for level in found}

    assert due() == {"visual": True, "operational": True}
    made = begin(world)
    assert due()["visual"]
    made.finish()
    assert due() == {"visual": False, "operational": True}
    with world.server.database.writing() as session:
        of = update(Inspection).where(Inspection.gym_id == world.gym.id)
        session.execute(of.values(finished_at=now() - timedelta(days=2)))
    assert due()["visual"]
    begin(world, corrects_id=made.id).finish()
    assert due()["visual"]  # a correction inspects nothing


def test_the_command_lists_exports_and_verifies(
    world: World, ended: InspectionOf, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = world.server.settings
    data = ["--data", str(settings.data)]
    if settings.database:
        data += ["--database", settings.database]
    assert main(["gym", "inspections", "list", world.gym.slug, *data]) == 0
    assert ended.id in capsys.readouterr().out
    folder = tmp_path / "records"
    assert main(["gym", "inspections", "export", world.gym.slug, str(folder), *data]) == 0
    [file] = folder.glob("*.json")
    assert main(["gym", "inspections", "verify", str(file)]) == 0
    printed = capsys.readouterr().out
    assert paper.spaced_code(ended.read()["code"]) in printed
    file.write_text(file.read_text().replace("3 cm", "1 cm"))
    assert main(["gym", "inspections", "verify", str(file)]) == 1
    file.write_text("[]")
    assert main(["gym", "inspections", "verify", str(file)]) == 3
    assert main(["gym", "inspections", "list", "nowhere", *data]) == 3
