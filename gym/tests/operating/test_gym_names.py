"""After an account is deleted, no name and no text of its person is left."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from uuid import uuid4

import pytest
import sqlalchemy as sa
from gym.tests.competitions.contest import Contest
from gym.tests.worlds import PASSWORD, Server, World, hold, make_world
from sqlalchemy import select

import walltopo_gym
from walltopo_gym.accounts.mails import new_link
from walltopo_gym.database.base import Base

pytestmark = pytest.mark.both_databases("cascades")

NAME = "Zyxwina"  # in every text of the person
# Columns of text that deleting an account blanks, in tables whose rows stay.
FORGOTTEN = {
    "competition_entries": {"name", "team", "club", "gender"},
    "competition_waivers": {"signed_by"},
    "hold_reports": {"note"},
    "mailed_links": {"email"},
    "score_events": {"text", "device"},
}
# Columns of text that name people by id, if at all, or that the gym wrote about itself.
KEPT = {
    "announcements": {"texts"},
    "app_grants": {"code_hash", "challenge", "redirect", "scopes"},
    "app_refresh_tokens": {"token_hash"},
    "audit": {"action", "subject", "details"},
    "backup_runs": {"kind", "name", "state", "step", "error"},
    "competition_categories": {"name", "gender"},
    "competition_problems": {
        "label",
        "name",
        "colour",
        "grade",
        "wall",
        "points",
        "category_ids",
    },
    # A judge without an account is named by hand, as on a paper scorecard.
    "competition_judge_links": {"token_hash"},
    "competition_link_judges": {"name", "token_hash"},
    "competition_rounds": {"name", "kind", "scoring", "state"},
    "competition_waivers": {"text"},
    "competition_waves": {"name"},
    "competitions": {"name", "format", "state", "about", "fee", "waiver"},
    "floor_plans": {"sha256"},
    "grade_systems": {"name", "kind", "grades"},
    "gym_aims": {"targets", "stock"},
    "gyms": {
        "slug",
        "name",
        "place",
        "time_zone",
        "visibility",
        "joining",
        "units",
        "paper",
        "boards",
        "features_off",
        "features_barred",
    },
    "hall_settings": {"parts", "key_hash"},
    "hold_changes": {"colour", "kind"},
    "hold_comparisons": {"error"},
    "hold_reports": {"colour", "kind"},
    "inspected_walls": {"name"},
    "inspection_entries": {"mark", "note", "photo"},
    "inspection_plans": {"levels"},
    # A finished record keeps its authors' names (docs/gym-security.md).
    "inspections": {
        "level",
        "checklist",
        "result",
        "remarks",
        "record",
        "public_key",
        "signature",
        "code",
    },
    "invitations": {"role", "token_hash"},
    "lists": {"name", "note", "share", "items"},
    "mailed_links": {"kind", "token_hash"},
    "oidc_attempts": {"state_hash", "nonce", "verifier"},
    "own_networks": {"basis", "result", "key", "error"},
    "people": {"email", "name", "password_hash"},
    "photo_overlaps": {"gaps", "groups", "shifts"},
    "photos": {"name", "state", "reason", "sha256"},
    "placements": {"holds", "hold_types", "reach", "longest_reach", "features", "as_was"},
    "plans": {"entries", "found", "error"},
    "request_counts": {"key"},
    "reset_plans": {"note", "wishes", "state"},
    "route_sign_offs": {"grade"},
    "rope_lines": {"label", "belays", "points"},
    "routes": {"name", "colour", "grade", "setter", "tags"},
    "scan_edits": {"log"},
    "scan_places": {"model", "learnt", "reach"},
    "scan_progress": {"stage", "doing", "notes"},
    "scans": {
        "state",
        "error",
        "hint",
        "files",
        "scale",
        "distance",
        "colours",
        "moves",
        "network",
    },
    "score_events": {"kind"},
    "server_secrets": {"name", "content"},
    "storage_use": {"kind"},
    "tries": {"key"},
    "walls": {"name", "zone"},
    "webhook_events": {"body", "error"},
    "webhooks": {"url", "secret"},
    "workers": {"name", "version"},
}


def tables() -> Iterator[sa.Table]:
    for module in pkgutil.walk_packages(walltopo_gym.__path__, "walltopo_gym."):
        if module.name.endswith(".models"):
            importlib.import_module(module.name)
    yield from Base.metadata.tables.values()


def goes_with_a_person(table: sa.Table) -> bool:
    """Whether the rows of a table are deleted with the person whom they name."""
    keys = [key for column in table.columns for key in column.foreign_keys]
    return any(key.column.table.name == "people" and key.ondelete == "CASCADE" for key in keys)


def test_every_text_that_outlives_a_person_is_known() -> None:
    """A new column of text goes with its person, is blanked by `forget`, or is listed here."""
    for table in tables():
        if goes_with_a_person(table):
            continue
        kinds = sa.String, sa.JSON, sa.LargeBinary
        found = {column.name for column in table.columns if isinstance(column.type, kinds)}
        listed = FORGOTTEN.get(table.name, set()) | KEPT.get(table.name, set())
        assert found == listed, table.name


def rows_with(server: Server, word: str) -> list[str]:
    """Return the table and content of each row that has a word."""
    found = []
    with server.database.reading() as session:
        for table in tables():
            for row in session.execute(select(table)):
                if word in repr(tuple(row)):
                    found.append(f"{table.name}: {tuple(row)!r}")
    return found


@pytest.fixture
def public(world: World) -> World:
    """A gym that everybody sees, with a person of their own in it."""
    people = world.people | {"climber": world.server.person(NAME)}
    made = make_world(world.server, people, visibility="public")
    assert world.server.ask("POST", f"{made.path}/join", people["climber"]).is_success
    return made


def enter(world: World) -> Contest:
    """Return an ended competition with the person's results, waivers and appeal."""
    given = {"self_entry": True, "self_scoring": True, "waiver": "I fall."}
    contest = Contest(world, given).make()
    contest.move("running")
    body = {
        "category_id": contest.sheet["categories"][0]["id"],
        "waiver": "I fall.",
        "club": f"{NAME} SC",
    }
    mine = contest.ask("PUT", "/mine", body, "climber")
    assert mine.is_success, mine.text
    entry = mine.json()["entry"]["id"]
    contest.say(entry, "top", 0, 1, who="climber", device=f"{NAME}-phone")
    appeal = contest.say(entry, "appeal", text=f"{NAME} did top it", who="climber").json()["id"]
    contest.say(entry, "decision", n=0, target_id=appeal, text=f"no, {NAME}")
    contest.say(entry, "out", text=f"{NAME} shouted")
    contest.ask("PUT", f"/entries/{entry}/waiver", {"signed_by": f"{NAME}'s father"})
    contest.move("ended")
    return contest


def climb(world: World) -> None:
    """Let the person write something wherever a climber can."""
    who, server = world.people["climber"], world.server
    holds = [hold(n, 0.3 * n, 0.4 * n) for n in range(1, 5)]
    scan = world.reviewed({1: [1]}, holds)
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    place = {"wall_id": str(world.wall.id), "scan_id": str(scan)}
    report = place | {"hold": 2, "kind": "spins", "note": f"{NAME} fell"}
    assert server.ask("PUT", f"{world.path}/hold-reports/{uuid4()}", who, report).is_success
    used = [{"hold": 1, "use": "start"}, {"hold": 4, "use": "top"}]
    problem = f"{world.path}/problems/{uuid4()}"
    body = place | {"holds": used, "name": "Hard", "share": "gym", "note": f"by {NAME}"}
    assert server.ask("PUT", problem, who, body).is_success
    assert server.ask("POST", f"{problem}/promote", world.people["setter"]).is_success
    complaint = {"reason": "not nice"}
    assert server.ask("PUT", f"{problem}/report", world.people["member"], complaint).is_success
    with server.database.writing() as session:
        new_link(session, "reset", who.email)


def test_nothing_of_a_deleted_person_is_left(public: World) -> None:
    server, who = public.server, public.people["climber"]
    contest = enter(public)
    climb(public)
    ban = {"reason": f"{NAME} was loud"}
    assert server.ask("PUT", f"{public.path}/bans/{who.id}", public.owner, ban).is_success
    assert len(rows_with(server, NAME)) > 8
    assert server.ask("POST", "/me/delete", who, {"password": PASSWORD}).is_success
    assert rows_with(server, NAME) == []
    assert contest.ranks() == [(None, "—")]


def looked_at(contest: Contest, tag: str) -> tuple[list[str], str]:
    """Return all answers about a competition's results, and the tag of its board."""
    board = contest.ask("GET", "/board", who="nobody", headers={"if-none-match": tag})
    texts = [contest.ask("GET", path, who="nobody").text for path in ("/results.csv", "/board")] + [
        board.text
    ]
    return texts, board.headers["etag"]


def test_boards_and_tables_that_somebody_looked_at_lose_the_name_at_once(public: World) -> None:
    contest = enter(public)
    texts, tag = looked_at(contest, "")
    assert all(NAME in one for one in texts)
    who = public.people["climber"]
    assert public.server.ask("POST", "/me/delete", who, {"password": PASSWORD}).is_success
    texts, _ = looked_at(contest, tag)  # by the tag of the board with the name
    assert not any(NAME in one for one in texts)
    assert all("—" in one for one in texts)
