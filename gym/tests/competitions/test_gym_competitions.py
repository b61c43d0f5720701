"""Competitions through the API: made from the wall, entered, judged, frozen, replayed, exported."""

from __future__ import annotations

import csv
import io
from datetime import datetime, timedelta
from typing import Any
from uuid import uuid4

import pytest
from gym.tests.competitions.contest import PROBLEMS, Contest, hang_routes
from gym.tests.worlds import PASSWORD, World, make_world
from sqlalchemy import select
from tests.at_once import at_once

from walltopo_gym.clock import now
from walltopo_gym.competitions.calendar import dates_of
from walltopo_gym.competitions.models import WaiverSignature
from walltopo_gym.languages import LANGUAGES


@pytest.fixture
def public(world: World) -> World:
    """A gym that everybody sees."""
    return make_world(world.server, world.people, visibility="public")


def running(world: World, **words: Any) -> Contest:
    contest = Contest(world, words).make()
    contest.move("running")
    return contest


def test_a_festival_from_the_routes_on_the_wall(public: World) -> None:
    routes = hang_routes(public)
    contest = Contest(public, routes=routes).make()
    problems = contest.sheet["rounds"][0]["problems"]
    assert [(p["label"], p["name"], p["colour"]) for p in problems] == [
        (str(n), name, "red") for n, name in enumerate(PROBLEMS, 1)
    ]
    assert contest.ask("GET", "", who="member").status_code == 404  # a draft
    contest.move("running")
    jana, ivo, uma = (contest.entry(name) for name in ("Jana", "Ivo", "Uma"))
    assert contest.say(jana, "top", 0, 1).status_code == 201
    assert contest.say(ivo, "top", 0, 2).status_code == 201
    assert contest.say(ivo, "zone", 1, 3).status_code == 201
    assert contest.say(uma, "attempt", 1, 1).status_code == 201
    board = contest.board()
    lines = board["categories"][0]["lines"]
    assert [(x["rank"], x["name"], x["points"]) for x in lines] == [
        (1, "Ivo", "140"),
        (2, "Jana", "120"),
        (3, "Uma", "0"),
    ]
    # Stripped, the problem stays what it was.
    strip = f"{public.path}/routes/{routes[0]}/strip"
    assert public.server.ask("POST", strip, public.people["setter"]).is_success
    public.server.ask("DELETE", f"{public.path}/walls/{public.wall.id}", public.owner)
    kept = contest.ask("GET", "", who="nobody").json()["rounds"][0]["problems"][0]
    assert (kept["name"], kept["route_id"]) == ("Moon", None)


def test_an_event_arrives_once_and_is_never_changed(public: World) -> None:
    contest = running(public)
    jana, event = contest.entry("Jana"), uuid4()
    moment = now().isoformat()
    words: dict[str, Any] = {"number": 7, "made_at": moment}

    def send() -> int:
        return contest.say(jana, "top", 0, 2, event=event, **words).status_code

    statuses = at_once(*4 * [send])
    assert sorted(statuses) == [200, 200, 200, 201]
    assert contest.say(jana, "top", 0, 1, event=event, **words).status_code == 409
    payload = contest.ask("GET", "/events", who="judge").json()
    assert [(item["id"], item["seq"], item["by_name"]) for item in payload["items"]] == [
        (str(event), 1, "judge")
    ]


def test_undo_correction_and_disqualification(public: World) -> None:
    contest = running(public)
    jana, ivo = contest.entry("Jana"), contest.entry("Ivo")
    tops = [contest.say(ivo, "top", 0, 1).json()["id"], contest.say(jana, "top", 0, 3).json()["id"]]
    assert contest.ranks() == [(1, "Ivo"), (2, "Jana")]
    undo = contest.say(ivo, "void", 0, target_id=tops[0]).json()["id"]
    assert contest.ranks() == [(1, "Jana"), (None, "Ivo")]
    contest.say(ivo, "void", 0, target_id=undo)  # the undo undone
    assert contest.ranks() == [(1, "Ivo"), (2, "Jana")]
    contest.say(ivo, "zone", 0, 1, target_id=tops[0])  # a zone in place of the top
    assert contest.ranks() == [(1, "Jana"), (2, "Ivo")]
    marks = contest.ask("GET", f"/problems/{contest.problem(0)}/marks", who="judge").json()
    assert {m["entry_id"]: (m["zone"], m["top"]) for m in marks} == {ivo: (1, None), jana: (3, 3)}
    assert all(event["counts"] for mark in marks for event in mark["events"])
    contest.say(jana, "out", text="chalk on the start list")
    assert contest.ranks() == [(1, "Ivo"), (None, "Jana")]
    assert contest.board()["categories"][0]["lines"][1]["out"] == "chalk on the start list"
    outs = contest.ask("GET", "/events?kind=out", who="judge").json()["items"]
    assert [(out["entry_id"], out["counts"]) for out in outs] == [(jana, True)]
    contest.say(jana, "void", target_id=outs[0]["id"])
    assert contest.ranks() == [(1, "Jana"), (2, "Ivo")]
    outs = contest.ask("GET", "/events?kind=out", who="judge").json()["items"]
    assert [out["counts"] for out in outs] == [False]


def test_who_may_enter_what(public: World) -> None:
    contest = Contest(
        public, {"self_entry": True, "self_scoring": True, "waiver": "I fall."}
    ).make()
    contest.move("open")
    category = contest.sheet["categories"][0]["id"]
    body = {"category_id": category, "name": "Mina", "waiver": "I fly."}
    assert contest.ask("PUT", "/mine", body, "member").status_code == 409  # another text
    assert contest.ask("PUT", "/mine", body | {"waiver": "I fall."}, "member").is_success
    own = contest.ask("GET", "/mine", who="member").json()
    assert own["entry"]["waiver_at"] is not None
    mine, other = own["entry"]["id"], contest.entry("Ivo")
    assert contest.say(mine, "top", 0, 1, who="member").status_code == 409  # not begun
    contest.move("running")
    assert contest.say(other, "top", 0, 1, who="member").status_code == 403
    assert contest.say(mine, "out", text="x", who="member").status_code == 403
    assert contest.say(mine, "top", 0, 1, who="member").status_code == 201
    judged = contest.say(mine, "zone", 1, 1).json()["id"]
    assert contest.say(other, "top", 2, 1).is_success  # on nobody else's card
    assert contest.say(mine, "void", 1, target_id=judged, who="member").status_code == 403
    marks = contest.ask("GET", "/mine", who="member").json()["marks"]
    assert [(m["tries"], m["zone"], m["top"]) for m in marks] == [(1, 1, 1), (1, 1, None)]
    # An appeal, and its decision.
    appeal = contest.say(mine, "appeal", 1, who="member", text="I had the top").json()["id"]
    assert contest.say(mine, "decision", 1, 1, target_id=judged, text="?").status_code == 422
    assert contest.say(mine, "decision", 1, 1, target_id=appeal, text="seen").status_code == 201
    appeals = contest.ask("GET", "/appeals", who="judge").json()
    assert [(a["event"]["text"], a["decision"]["n"]) for a in appeals] == [("I had the top", 1)]


def test_own_results_in_their_window_by_a_wrong_clock(public: World) -> None:
    """A phone whose clock is a year behind, offline for an hour; and one that is too late."""
    over = now() - timedelta(minutes=30)
    rounds = [
        {
            "name": "Night",
            "scoring": {"rules": "most"},
            "problems": [{"name": "A"}],
            "closes_at": over.isoformat(),
        }
    ]
    contest = running(public, format="night", rounds=rounds, self_entry=True, self_scoring=True)
    body = {"category_id": contest.sheet["categories"][0]["id"]}
    mine = contest.ask("PUT", "/mine", body, "member").json()["entry"]["id"]
    began = now()
    phone = began - timedelta(days=365)

    def late(hours: float) -> int:
        made = phone - timedelta(hours=hours)
        answer = contest.say(
            mine, "top", 0, 1, who="member", made_at=made.isoformat(), sent_at=phone.isoformat()
        )
        return answer.status_code

    assert late(0.25) == 409
    assert late(1) == 201
    payload = contest.ask("GET", "/events", who="judge").json()["items"][0]
    assert began <= datetime.fromisoformat(payload["climbed_at"]) + timedelta(hours=1) <= now()


FINAL = {
    "format": "rounds",
    "rounds": [
        {
            "name": "Qualification",
            "kind": "qualification",
            "scoring": {"rules": "ifsc-2025"},
            "problems": [{"name": "A"}, {"name": "B"}],
        },
        {
            "name": "Final",
            "kind": "final",
            "scoring": {"rules": "ifsc-2025"},
            "quota": 2,
            "problems": [{"name": "C"}],
        },
    ],
}


def test_a_final_its_running_order_and_countback(public: World) -> None:
    contest = running(public, **FINAL)
    jana, ivo, uma = (contest.entry(name) for name in ("Jana", "Ivo", "Uma"))
    contest.say(jana, "top", 0, 2)
    contest.say(ivo, "top", 0, 1)
    contest.say(uma, "zone", 0, 1)
    assert contest.move_round(1, "running").status_code == 409  # the one before has not ended
    assert contest.say(jana, "top", 0, 1, one=1).status_code == 409
    assert contest.move_round(0, "ended").is_success
    contest.sheet = contest.move_round(1, "running").json()
    final = contest.sheet["rounds"][1]["id"]
    order = contest.ask("GET", f"/rounds/{final}/starters", who="nobody").json()
    assert [(o["place"], o["name"]) for o in order] == [(1, "Jana"), (2, "Ivo")]
    assert contest.say(uma, "top", 0, 1, one=1).status_code == 409  # is not in it
    # Nothing climbed yet: the qualification decides, and so it does when both top in two tries.
    assert contest.ranks() == [(1, "Ivo"), (2, "Jana"), (3, "Uma")]
    assert contest.say(jana, "top", 0, 2, one=1).status_code == 201
    assert contest.ranks() == [(1, "Jana"), (2, "Ivo"), (3, "Uma")]
    assert contest.say(ivo, "top", 0, 2, one=1).status_code == 201
    assert contest.ranks() == [(1, "Ivo"), (2, "Jana"), (3, "Uma")]
    why = contest.ask("GET", f"/board/why?first={jana}&second={ivo}", who="nobody").json()
    assert why["before"] == "second"
    assert [(s["code"], s["first"], s["second"], s["decides"]) for s in why["steps"]] == [
        ("round", "Final", "Final", False),
        ("points", "24.9", "24.9", False),
        ("countback", "24.9", "25", True),
    ]
    other = {"category_id": order[0]["category_id"], "entry_ids": [uma, ivo]}
    assert contest.ask("PUT", f"/rounds/{final}/starters", other).json()[0]["name"] == "Uma"
    refused = contest.ask("POST", f"/rounds/{final}/starters/draw").json()
    assert refused["code"] == "cup-scored-in-round"


def order_of(contest: Contest, number: int, method: str = "GET", draw: str = "") -> list[str]:
    """Names in running order of a round."""
    path = f"/rounds/{contest.sheet['rounds'][number]['id']}/starters{draw}"
    answer = contest.ask(method, path)
    assert answer.is_success, answer.text
    return [row["name"] for row in answer.json()]


def test_an_order_is_drawn_ahead_moved_and_drawn_anew(public: World) -> None:
    contest = running(public, **FINAL)
    names = ["Jana", "Ivo", "Uma"]
    ids = {name: contest.entry(name) for name in names}
    final = contest.sheet["rounds"][1]["id"]
    draw = f"/rounds/{final}/starters/draw"
    assert contest.ask("POST", draw).json()["code"] == "cup-before-not-ended"
    for tries, name in enumerate(names, 1):
        contest.say(ids[name], "top", 0, tries)
    contest.move_round(0, "ended")
    assert order_of(contest, 1) == []
    assert order_of(contest, 1, "POST", "/draw") == ["Ivo", "Jana"]
    category = contest.sheet["categories"][0]["id"]
    moved = {"category_id": category, "entry_ids": [ids["Uma"], ids["Ivo"]]}
    assert contest.ask("PUT", f"/rounds/{final}/starters", moved).is_success
    # An order that was drawn and moved before the round stays, unless the round before goes on.
    assert contest.move_round(1, "running").is_success
    assert order_of(contest, 1) == ["Uma", "Ivo"]
    assert order_of(contest, 1, "POST", "/draw") == ["Ivo", "Jana"]
    contest.ask("PATCH", f"/entries/{ids['Ivo']}", {"withdrawn": True})
    assert order_of(contest, 1) == ["Jana"]


def test_an_order_drawn_ahead_is_gone_when_the_round_before_goes_on(public: World) -> None:
    contest = running(public, **FINAL)
    jana, ivo = contest.entry("Jana"), contest.entry("Ivo")
    contest.say(jana, "top", 0, 1)
    contest.say(ivo, "top", 0, 2)
    contest.move_round(0, "ended")
    assert order_of(contest, 1, "POST", "/draw") == ["Ivo", "Jana"]
    contest.move_round(0, "running")
    assert order_of(contest, 1) == []
    contest.say(ivo, "top", 1, 1)
    contest.move_round(0, "ended")
    contest.move_round(1, "running")
    assert order_of(contest, 1) == ["Jana", "Ivo"]


def test_where_all_climb_the_order_is_by_number_by_lot_or_by_hand(public: World) -> None:
    contest = running(public, categories=[{"name": "B"}, {"name": "A"}])
    ids = {
        name: contest.entry(name, category=at)
        for name, at in (("Jana", 1), ("Ivo", 0), ("Uma", 0), ("Eva", 0))
    }
    assert order_of(contest, 0) == ["Ivo", "Uma", "Eva", "Jana"]
    drawn = order_of(contest, 0, "POST", "/draw")
    assert sorted(drawn[:3]) == ["Eva", "Ivo", "Uma"]
    assert drawn[3:] == ["Jana"]
    one = contest.sheet["rounds"][0]["id"]
    body = {
        "category_id": contest.sheet["categories"][0]["id"],
        "entry_ids": [ids["Eva"], ids["Ivo"]],
    }
    contest.ask("PUT", f"/rounds/{one}/starters", body)
    contest.entry("Late")
    assert order_of(contest, 0) == ["Eva", "Ivo", "Uma", "Late", "Jana"]
    # It is an order and no more: all of them may climb.
    assert contest.say(ids["Uma"], "top", 0, 1).status_code == 201
    assert contest.ask("POST", f"/rounds/{one}/starters/draw").status_code == 409


def test_frozen_for_all_but_judges_and_replayed_to_any_moment(public: World) -> None:
    contest = running(public)
    jana, ivo = contest.entry("Jana"), contest.entry("Ivo")
    contest.say(jana, "top", 0, 2)
    before = now()
    assert contest.ask("PUT", "/frozen", {"frozen": True}).is_success
    contest.say(ivo, "top", 0, 1)
    assert contest.ranks("nobody") == contest.ranks("member") == [(1, "Jana"), (None, "Ivo")]
    assert contest.board("nobody")["frozen_at"] is not None
    assert contest.ranks("judge") == [(1, "Ivo"), (2, "Jana")]
    assert contest.ranks("judge", before) == [(1, "Jana"), (None, "Ivo")]
    assert contest.ranks("nobody", now()) == [(1, "Jana"), (None, "Ivo")]
    why = f"/board/why?first={jana}&second={ivo}"
    assert contest.ask("GET", why, who="nobody").json()["steps"] == []
    table = contest.ask("GET", "/results.csv", who="nobody")
    assert [row["rank"] for row in csv.DictReader(io.StringIO(table.text.lstrip("\ufeff")))] == [
        "1",
        "",
    ]
    assert contest.ask("PUT", "/frozen", {"frozen": False}).is_success
    assert contest.ranks("nobody") == [(1, "Ivo"), (2, "Jana")]


def test_the_same_board_is_not_sent_twice(public: World) -> None:
    contest = running(public)
    jana = contest.entry("Jana")
    tag = contest.ask("GET", "/board", who="nobody").headers["etag"]
    unchanged: dict[str, Any] = {"headers": {"if-none-match": tag}, "who": "nobody"}
    assert contest.ask("GET", "/board", **unchanged).status_code == 304
    contest.say(jana, "top", 0, 1)
    assert contest.ask("GET", "/board", **unchanged).status_code == 200


def test_results_as_table_and_on_paper(public: World) -> None:
    contest = running(public)
    contest.say(contest.entry("=cmd()", team="+team"), "top", 0, 1)
    rows = list(
        csv.DictReader(io.StringIO(contest.ask("GET", "/results.csv").text.lstrip("\ufeff")))
    )
    assert [(row["rank"], row["name"], row["team"]) for row in rows] == [("1", "'=cmd()", "'+team")]
    assert rows[0]["1. Session: tops"] == "1"
    german = contest.ask("GET", "/results.csv?language=de").text
    assert german.startswith("\ufeffcategory;rank;shared;bib;")
    for language in LANGUAGES:
        paper = contest.ask("GET", f"/results.pdf?language={language}", who="nobody")
        assert paper.headers["content-type"] == "application/pdf"
        assert paper.content.startswith(b"%PDF")


def test_what_is_climbed_in_cannot_be_taken_away(public: World) -> None:
    contest = running(public)
    sheet = {name: contest.sheet[name] for name in ("categories", "rounds")}
    categories = [{k: v for k, v in c.items() if k != "entries"} for c in sheet["categories"]]
    names = ("id", "name", "kind", "scoring", "quota")
    rounds = [
        {k: v for k, v in r.items() if k in names} | {"problems": r["problems"]}
        for r in sheet["rounds"]
    ]
    contest.say(contest.entry("Jana"), "top", 0, 1)
    fewer = [rounds[0] | {"problems": rounds[0]["problems"][1:]}]
    same = {"categories": categories, "rounds": rounds}
    assert contest.ask("PUT", "/sheet", same | {"rounds": fewer}).status_code == 409
    others = [{"name": "Women", "gender": "women"}]
    assert contest.ask("PUT", "/sheet", same | {"categories": others}).status_code == 409
    more = [*categories, *others]
    assert contest.ask("PUT", "/sheet", same | {"categories": more}).is_success
    assert contest.ranks() == [(1, "Jana")]
    assert contest.ask("DELETE", "", who="owner").status_code == 409


def test_a_league_with_teams_and_handicap(public: World) -> None:
    weeks = [
        {
            "name": f"Week {n}",
            "kind": "week",
            "scoring": {"rules": "points"},
            "problems": [{"name": "A"}, {"name": "B"}],
        }
        for n in (1, 2)
    ]
    contest = running(public, format="league", rounds=weeks, league_best=1, team_size=1)
    jana = contest.entry("Jana", team="Blue")
    ivo = contest.entry("Ivo", team="Blue", handicap=15)
    uma = contest.entry("Uma", team="Red")
    assert contest.move_round(1, "running").is_success
    contest.say(jana, "top", 0, 1)
    contest.say(jana, "top", 0, 2, one=1)
    contest.say(ivo, "top", 1, 2)
    contest.say(uma, "zone", 0, 2, one=1)
    board = contest.board()
    lines = board["categories"][0]["lines"]
    assert [(x["name"], x["points"]) for x in lines] == [
        ("Jana", "120"),
        ("Ivo", "115"),
        ("Uma", "40"),
    ]
    assert [(t["name"], t["points"], t["members"]) for t in board["teams"]] == [
        ("Blue", "120", ["Ivo", "Jana"]),
        ("Red", "40", ["Uma"]),
    ]


def test_a_start_list_all_or_nothing(public: World) -> None:
    words = {"categories": [{"name": "U18", "born_from": 2009}, {"name": "Open"}]}
    contest = Contest(public, words).make()
    table = "Name;Category;Bib;Birth year;Gender\nŽofie Nová;U18;7;2010;w\nIvo;open;;;m\n"
    wrong = table + "Old;U18;7;1950;z\n;Elsewhere;0;;\n"
    payload = contest.ask("POST", "/entries/import", {"csv": wrong}).json()
    assert {(fault["line"], fault["column"]) for fault in payload["errors"]} == {
        (4, "bib"),
        (4, "gender"),
        (4, "category"),
        (5, "name"),
        (5, "category"),
        (5, "bib"),
    }
    errors = {fault["column"]: fault for fault in payload["errors"] if fault["line"] == 5}
    assert errors["category"]["code"] == "cell-no-category"
    assert errors["category"]["values"] == {"name": "Elsewhere", "names": "U18, Open"}
    assert errors["category"]["hint"] == "Categories: U18, Open."
    assert (errors["name"]["code"], errors["name"]["hint_code"]) == (
        "cell-no-name",
        "cell-write-name",
    )
    assert contest.ask("GET", "/entries").json() == []
    assert contest.ask("POST", "/entries/import", {"csv": table}).json()["entries"] == 2
    entries = contest.ask("GET", "/entries").json()
    assert [(e["bib"], e["name"], e["birth_year"]) for e in entries] == [
        (7, "Žofie Nová", 2010),
        (8, "Ivo", None),
    ]
    assert contest.ask("POST", "/entries/import", {"csv": "a,b\n"}).status_code == 422


def test_the_same_start_list_twice_adds_nobody_twice(public: World) -> None:
    contest = Contest(public, {"categories": [{"name": "Ma\u0308nner"}]}).make()
    table = "name;category;bib;birth_year\nB\u00f6hm;M\u00e4nner;7;2001\nNov\u00e1;M\u00e4nner;;\n"
    first = contest.ask("POST", "/entries/import", {"csv": table}).json()
    assert (first["entries"], first["known"], first["errors"]) == (2, [], [])
    more = table + "Bo\u0308hm;M\u00e4nner;;1980\n"  # another person of that name
    second = contest.ask("POST", "/entries/import", {"csv": more}).json()
    assert (second["entries"], second["errors"]) == (1, [])
    assert [(one["line"], one["name"], one["bib"]) for one in second["known"]] == [
        (2, "B\u00f6hm", 7),
        (3, "Nov\u00e1", 8),
    ]
    names = sorted(entry["name"] for entry in contest.ask("GET", "/entries").json())
    assert names == ["B\u00f6hm", "B\u00f6hm", "Nov\u00e1"]


NAMESAKES = (
    ("name;club\nEva;Praha\n", "name;club\nEva;Brno\n", 2),
    ("name;club\nEva;Praha\n", "name;club\nEva;PRAHA\n", 1),
    ("name;team\nEva;Blue\n", "name;team\nEva;Red\n", 2),
    ("name;gender\nSascha;w\n", "name;gender\nSascha;m\n", 2),
    ("name;birth_year\nEva;2001\n", "name;birth_year\nEva;2002\n", 2),
    ("name\nEva\n", "name\nEva\nEva\n", 2),  # two lines are two people
    ("name\nEva\nEva\n", "name\nEva\nEva\n", 2),
    ("name\nEva\n", "name;club\nEva;Brno\n", 1),  # nothing tells them apart: see below
)


@pytest.mark.parametrize(("first", "second", "people"), NAMESAKES)
def test_a_list_distinguishes_people_of_one_name_by_its_other_cells(
    public: World, first: str, second: str, people: int
) -> None:
    contest = Contest(public, {"categories": [{"name": "Open"}]}).make()
    for table in (first, second):
        payload = contest.ask("POST", "/entries/import", {"csv": table}).json()
        assert payload["errors"] == []
    assert len(contest.ask("GET", "/entries").json()) == people


def test_where_nothing_tells_two_people_apart_the_list_says_whom_it_means(public: World) -> None:
    contest = Contest(public, {"categories": [{"name": "Open"}]}).make()
    assert contest.ask("POST", "/entries/import", {"csv": "name\nEva\n"}).json()["entries"] == 1
    found = contest.ask("POST", "/entries/import", {"csv": "name\nEva\n"}).json()
    assert [(one["line"], one["bib"]) for one in found["known"]] == [(2, 1)]
    body = {"csv": "name\nEva\n", "others": [2]}
    found = contest.ask("POST", "/entries/import", body).json()
    assert (found["entries"], found["known"]) == (1, [])
    assert [one["bib"] for one in contest.ask("GET", "/entries").json()] == [1, 2]


LOOKS_THE_SAME = ("U\u00a014", "U  14", " U 14\u200b", "U\u2009 14 ", "\ufeffU 14", "u 14")


@pytest.mark.parametrize("spaced", LOOKS_THE_SAME)
def test_white_space_that_looks_the_same_is_the_same(public: World, spaced: str) -> None:
    contest = Contest(public, {"categories": [{"name": "U 14"}]}).make()
    contest.ask("POST", "/entries/import", {"csv": "name;category\nEva Nov\u00e1;U 14\n"})
    name = spaced.replace("U", "Eva").replace("u", "eva").replace("14", "Nov\u00e1")
    again = f"name\u00a0;category\n{name};{spaced}\n"
    found = contest.ask("POST", "/entries/import", {"csv": again}).json()
    assert (found["entries"], len(found["known"]), found["errors"]) == (0, 1, [])
    made = contest.ask(
        "POST",
        "/entries",
        {
            "name": f" {name} ",
            "category_id": contest.sheet["categories"][0]["id"],
        },
    ).json()
    assert made["name"].casefold() == "eva nov\u00e1"
    twice = contest.ask(
        "PUT",
        "/sheet",
        {
            "categories": [{"name": "U 14"}, {"name": spaced}],
            "rounds": contest.sheet["rounds"],
        },
    )
    assert twice.status_code in (409, 422), twice.text


@pytest.mark.parametrize(
    "table",
    [
        "Spring Cup 2026\n\nname;category\nEva;Open\n",
        '"Spring Cup; in November"\nname;category\nEva;Open\n',
        "Spring Cup;;\nas of 3/11;;\nname;category;\nEva;Open;\n",
        'name;category\n"Eva\nNov\u00e1";Open\n',
        "sep=;\nname;category\nEva;Open\n",
        '"sep=,"\r\nname,category\r\nEva,Open\r\n',
        "name;category;;\nEva;Open;;\n;;;\n",
        "name;category\rEva;Open\r",
        "\ufeffname\tcategory\nEva\tOpen",
    ],
)
def test_lists_as_spreadsheets_write_them(public: World, table: str) -> None:
    contest = Contest(public, {"categories": [{"name": "Open"}]}).make()
    found = contest.ask("POST", "/entries/import", {"csv": table}).json()
    assert (found["entries"], found["errors"]) == (1, [])


@pytest.mark.parametrize(
    ("table", "code"),
    [
        ("name;category\nB\ufffdhm;Open\n", "table-letters"),
        ("PK\x03\x04\x14\x00\x06\x00[Content_Types].xml", "table-workbook"),
        ("\u00d0\u00cf\x11\u00e0\u00a1\u00b1", "table-workbook"),
        ("<html xmlns:x='urn:x'><table><tr><td>name</td></tr></table>", "table-web-page"),
        ("\n <?xml version='1.0'?><Workbook/>", "table-web-page"),
        ("sep=;\nname;category;\nEva;Open;\nIvo;Open;x\n", "table-no-column"),
    ],
)
def test_lists_that_lost_something_are_refused(public: World, table: str, code: str) -> None:
    contest = Contest(public, {"categories": [{"name": "Open"}]}).make()
    answer = contest.ask("POST", "/entries/import", {"csv": table})
    assert (answer.status_code, answer.json()["code"]) == (422, code)
    if code == "table-no-column":
        assert answer.json()["values"] == {"number": "4"}


def test_each_fault_of_a_start_list_has_a_code_and_what_to_do(public: World) -> None:
    words = {"categories": [{"name": "Girls", "gender": "women", "born_from": 2010}]}
    contest = Contest(public, words).make()
    lines = (
        ("Eva;;;;w", "category", "cup-needs-year", "cell-year-column"),
        ("Eva;;;2012;", "category", "cup-gender", "cell-gender-column"),
        ("Eva;;;2012;m", "category", "cup-gender", "cup-choose-category"),
        ("Eva;;;1999;w", "category", "cup-year", "cup-choose-category"),
        ("Eva;;;99;w", "birth_year", "cell-number", "cell-digits"),
        ("Eva;;x;2012;w", "bib", "cell-number", "cell-digits"),
        ("Eva;;;2012;q", "gender", "cell-gender", "cell-gender-write"),
        (f"{'E' * 81};;;2012;w", "name", "cell-too-long", "cell-shorten"),
        (";;;2012;w", "name", "cell-no-name", "cell-write-name"),
        ("Eva;Boys;;2012;w", "category", "cell-no-category", "cell-categories"),
    )
    table = "name;category;bib;birth_year;gender\n" + "\n".join(line for line, *_ in lines)
    payload = contest.ask("POST", "/entries/import", {"csv": table}).json()
    assert [(f["line"], f["column"], f["code"], f["hint_code"]) for f in payload["errors"]] == [
        (number, *expected) for number, (_, *expected) in enumerate(lines, 2)
    ]
    many = "name\n" + "Eva\n" * 2_001
    refused = Contest(public).make().ask("POST", "/entries/import", {"csv": many}).json()
    assert (refused["code"], refused["hint_code"]) == ("table-too-long", "table-in-parts")


def test_who_goes_takes_the_name_along_and_leaves_the_ranks(public: World) -> None:
    contest = Contest(public, {"self_entry": True, "waiver": "I fall."}).make()
    contest.move("running")
    person = public.server.person("mina")
    public.people["mina"] = person
    assert public.server.ask("POST", f"{public.path}/join", person).is_success
    body = {"category_id": contest.sheet["categories"][0]["id"], "waiver": "I fall."}
    mine = contest.ask("PUT", "/mine", body, "mina").json()["entry"]["id"]
    contest.say(mine, "top", 0, 1)
    data = public.server.ask("GET", "/me/data", person).json()
    assert [entry["name"] for entry in data["competition_entries"]] == ["mina"]
    assert len(data["competition_waivers"]) == 1
    gone = public.server.ask("POST", "/me/delete", person, {"password": PASSWORD})
    assert gone.is_success, gone.text
    assert contest.ranks() == [(1, "—")]
    with public.server.database.reading() as session:
        signed = session.scalars(select(WaiverSignature.signed_by)).all()
    assert "mina" not in signed


def test_the_calendar_knows_what_is_no_draft(public: World) -> None:
    starts = now() + timedelta(days=3)
    contest = Contest(public, {"starts_at": starts.isoformat()}).make()
    listed = public.server.ask("GET", f"{public.path}/competitions", public.people["setter"]).json()
    assert [one["time_zone"] for one in listed] == [public.gym.time_zone]
    for state, known in (("draft", []), ("open", [(contest.sheet["name"], starts)])):
        contest.move(state)
        with public.server.database.reading() as session:
            dates = dates_of(session, public.gym.id)
        assert [(date.name, date.starts_at) for date in dates] == known


def test_a_judge_who_lost_the_role_enters_nothing(public: World) -> None:
    """Also results of before, which waited in the phone for a connection."""
    contest = running(public)
    entry = contest.entry("Ivo")
    made = (now() - timedelta(minutes=10)).isoformat()
    assert contest.say(entry, "top", 0, 1).status_code == 201
    member = f"{public.path}/members/{public.people['judge'].id}"
    role = {"role": "member"}
    assert public.server.ask("PATCH", member, public.people["owner"], role).status_code == 204
    late = contest.say(entry, "top", 1, 1, made_at=made)
    assert late.status_code == 403, late.text
    assert contest.ranks() == [(1, "Ivo")]
    assert len(contest.ask("GET", "/events", who="setter").json()["items"]) == 1
