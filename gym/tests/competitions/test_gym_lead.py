"""Lead competitions: high points, ranks on several routes, countback, climbing time, holds."""

from __future__ import annotations

import csv
import io
from fractions import Fraction
from itertools import permutations
from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.competitions.contest import Contest
from gym.tests.competitions.test_gym_boards import key, sheets
from gym.tests.worlds import World, make_world
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo_gym.competitions.board import Leaderboard
from walltopo_gym.competitions.ledger import Fact, Kind, Ledger
from walltopo_gym.competitions.results import Results
from walltopo_gym.competitions.scoring.lead import average_ranks, score_lead, score_lead_points
from walltopo_gym.competitions.scoring.score import AttemptedProblem, Mark
from walltopo_gym.competitions.sheet import Sheet
from walltopo_gym.languages import LANGUAGES

LEAD = {
    "format": "rounds",
    "rounds": [
        {
            "name": "Qualification",
            "kind": "qualification",
            "scoring": {"rules": "ifsc-lead"},
            "problems": [{"name": "A", "holds": 40}, {"name": "B"}],
        },
        {
            "name": "Final",
            "kind": "final",
            "scoring": {"rules": "ifsc-lead"},
            "quota": 2,
            "problems": [{"name": "C", "holds": 45}],
        },
    ],
}


def fun(*holds: int | None, **words: Any) -> dict[str, Any]:
    """A festival that sums holds, one route for each number of holds."""
    problems = [{"name": f"Route {n}", "holds": number} for n, number in enumerate(holds, 1)]
    one = {"name": "Session", "scoring": {"rules": "lead-points"} | words, "problems": problems}
    return {"rounds": [one]}


@pytest.fixture
def public(world: World) -> World:
    """A gym that everybody sees."""
    return make_world(world.server, world.people, visibility="public")


def running(world: World, **words: Any) -> Contest:
    contest = Contest(world, words).make()
    contest.move("running")
    return contest


def high(contest: Contest, entry: str, which: int, text: str, **words: Any) -> str:
    """Enter a high point as judges write it (34+ or TOP); return the event's id."""
    n = words.pop("n", 1)
    if text == "TOP":
        answer = contest.say(entry, "top", which, n, **words)
    else:
        hold = int(text.rstrip("+"))
        answer = contest.say(entry, "high", which, n, hold=hold, plus=text[-1] == "+", **words)
    assert answer.status_code == 201, answer.text
    made: str = answer.json()["id"]
    return made


def test_equal_high_points_share_the_average_of_their_ranks() -> None:
    """Five at the top of a route have the ranks 1 to 5, so each has 3; the next is the sixth."""
    heights = dict(zip("abcdefgh", (9, 9, 9, 9, 9, 7, 5, 5), strict=True))
    ranks = average_ranks(heights)
    assert [ranks[who] for who in "aefgh"] == [3, 3, 6, Fraction(15, 2), Fraction(15, 2)]
    assert sum(ranks.values()) == sum(range(1, 9))


def test_the_geometric_mean_of_the_ranks_is_compared_exactly() -> None:
    routes = [key(3, n) for n in range(2)]
    tried = [AttemptedProblem(route, Mark(1, hold=20, high_try=1)) for route in routes]

    def scored(*ranks: Fraction) -> Any:
        return score_lead(tried, dict(zip(routes, ranks, strict=True)), 2)

    one = scored(Fraction(3), Fraction(15, 2))
    same = scored(Fraction(9, 2), Fraction(5))
    worse = scored(Fraction(3), Fraction(76, 10))
    assert (one.result, one.key) == ("4.74", same.key)
    assert worse.key < one.key
    assert score_lead((), {}, 2).key < worse.key
    many = {key(3, n): Fraction(1_999, 2) for n in range(500)}
    assert score_lead((), many, 500).result == "999.50"
    assert one.points is None


def test_a_top_before_a_hold_and_a_plus_before_none() -> None:
    marks = [
        Mark(1, top=1),
        Mark(1, hold=34, plus=True, high_try=1),
        Mark(1, hold=34, high_try=1),
        Mark(1, hold=33, plus=True, high_try=1),
        Mark(1, hold=0, high_try=1),
    ]
    scores = [score_lead([AttemptedProblem(key(3, 1), mark)], {}, 1) for mark in marks]
    scores.append(score_lead((), {}, 1))
    keys = [score.key for score in scores]
    assert keys == sorted(set(keys), reverse=True)
    assert [score.result for score in scores] == ["TOP", "34+", "34", "33+", "0", ""]


def test_a_hold_is_a_point_and_a_plus_half_of_one() -> None:
    def tried(n: int, mark: Mark, holds: int = 30) -> AttemptedProblem:
        return AttemptedProblem(key(3, n), mark, None, holds)

    marks = [
        tried(1, Mark(3, top=3)),
        tried(2, Mark(1, hold=12, plus=True, high_try=1)),
        tried(3, Mark(2, hold=30, plus=True, high_try=2)),
    ]
    score = score_lead_points(marks, None)
    assert (score.points, score.result) == (Fraction(145, 2), "72.5")  # a plus at the last is none
    assert [(one.code, one.shown) for one in score.criteria[1:]] == [
        ("tops", "1"),
        ("tries-to-high", "6"),
    ]
    assert score_lead_points(marks, 2).points == 60


def test_the_mark_does_not_depend_on_the_order_of_arrival() -> None:
    """Two judges enter the same attempt, one with a plus; the second attempt is lower."""
    entry, problem = key(2, 0), key(3, 0)
    facts = [
        Fact(key(4, 1), entry, problem, Kind.HIGH, 1, hold=21, plus=True, seconds=130),
        Fact(key(4, 2), entry, problem, Kind.HIGH, 1, hold=21, plus=True, seconds=128),
        Fact(key(4, 3), entry, problem, Kind.HIGH, 1, hold=21, seconds=90),
        Fact(key(4, 4), entry, problem, Kind.HIGH, 2, hold=7, seconds=40),
        Fact(key(4, 5), entry, problem, Kind.TOP, 3, seconds=200),
        Fact(key(4, 6), entry, problem, Kind.VOID, target=key(4, 5)),
    ]
    found = set()
    for order in permutations(facts):
        ledger = Ledger()
        for fact in order:
            ledger.add([fact, fact])
        found.add(ledger.mark(entry, problem))
    assert found == {Mark(2, hold=21, plus=True, high_try=1, seconds=128)}
    ledger = Ledger()
    ledger.add(facts[:5])
    assert ledger.mark(entry, problem) == Mark(3, 3, 3, seconds=200)


def test_a_lead_competition_to_its_final(public: World) -> None:
    contest = running(public, **LEAD)
    jana, ivo, uma, eva = (contest.entry(name) for name in ("Jana", "Ivo", "Uma", "Eva"))
    for entry, on_a, on_b in (
        (jana, "TOP", "20"),
        (ivo, "TOP", "20+"),
        (uma, "31", "25"),
        (eva, "30+", "4"),
    ):
        high(contest, entry, 0, on_a)
        high(contest, entry, 1, on_b)
    lines = contest.board()["categories"][0]["lines"]
    # Ranks on A: 1.5, 1.5, 3, 4; on B: 3, 2, 1, 4.
    assert [(line["rank"], line["name"], line["rounds"][0]["result"]) for line in lines] == [
        (1, "Ivo", "1.73"),
        (1, "Uma", "1.73"),
        (3, "Jana", "2.12"),
        (4, "Eva", "4.00"),
    ]
    problem = contest.problem(0)
    assert lines[0]["rounds"][0]["highs"][problem] == {
        "high": "TOP",
        "seconds": None,
        "rank": "1.5",
    }
    contest.move_round(0, "ended")
    contest.sheet = contest.move_round(1, "running").json()
    final = contest.sheet["rounds"][1]["id"]
    order = contest.ask("GET", f"/rounds/{final}/starters", who="nobody").json()
    assert {row["name"] for row in order} == {"Ivo", "Uma"}
    # The same high point after the same qualification: the shorter time wins.
    high(contest, ivo, 0, "38+", one=1, seconds=252)
    high(contest, uma, 0, "38+", one=1, seconds=251)
    assert contest.ranks()[:2] == [(1, "Uma"), (2, "Ivo")]
    why = contest.ask("GET", f"/board/why?first={uma}&second={ivo}", who="nobody").json()
    assert [(s["code"], s["first"], s["second"], s["decides"]) for s in why["steps"]] == [
        ("round", "Final", "Final", False),
        ("high", "38+", "38+", False),
        ("countback", "1.73", "1.73", False),
        ("time", "4:11", "4:12", True),
    ]
    table = contest.ask("GET", "/results.csv", who="nobody").text.lstrip("\ufeff")
    row = next(iter(csv.DictReader(io.StringIO(table))))
    columns = (
        "1. Qualification: high 1: 1",
        "1. Qualification: result",
        "2. Final: high 1: 1",
        "2. Final: seconds 1: 1",
    )
    assert [row[column] for column in columns] == ["31", "1.73", "38+", "251"]
    for language in LANGUAGES:
        paper = contest.ask("GET", f"/results.pdf?language={language}", who="nobody")
        assert paper.content.startswith(b"%PDF")


def test_in_a_final_the_round_before_decides_before_the_time(public: World) -> None:
    contest = running(public, **LEAD)
    jana, ivo, uma = (contest.entry(name) for name in ("Jana", "Ivo", "Uma"))
    for entry, text in ((jana, "30"), (ivo, "29"), (uma, "12")):
        high(contest, entry, 0, text)
        high(contest, entry, 1, text)
    # The time of a qualification breaks no tie.
    contest.move_round(0, "ended")
    contest.move_round(1, "running")
    high(contest, jana, 0, "TOP", one=1, seconds=300)
    high(contest, ivo, 0, "TOP", one=1, seconds=100)
    assert contest.ranks() == [(1, "Jana"), (2, "Ivo"), (3, "Uma")]


def test_a_judge_corrects_a_high_point_and_takes_it_back(public: World) -> None:
    contest = running(public, **LEAD)
    jana, ivo = contest.entry("Jana"), contest.entry("Ivo")
    first = high(contest, jana, 0, "21+")
    high(contest, ivo, 0, "21")
    assert contest.ranks() == [(1, "Jana"), (2, "Ivo")]
    less = high(contest, jana, 0, "20", target_id=first)
    assert contest.ranks() == [(1, "Ivo"), (2, "Jana")]
    contest.say(jana, "void", 0, target_id=less)
    assert contest.ranks() == [(1, "Jana"), (2, "Ivo")]
    path = f"/problems/{contest.problem(0)}/marks"
    marks = contest.ask("GET", path, who="judge").json()
    assert {m["entry_id"]: (m["tries"], m["hold"], m["plus"]) for m in marks} == {
        jana: (1, 21, True),
        ivo: (1, 21, False),
    }
    appeal = contest.say(ivo, "appeal", 0, text="I moved on").json()["id"]
    assert contest.say(ivo, "decision", 0, 1, target_id=appeal, text="yes").status_code == 201
    assert contest.ranks() == [(1, "Jana"), (2, "Ivo")]
    high(contest, ivo, 0, "21+")  # the correction itself; the first entry stays
    assert contest.ranks() == [(1, "Jana"), (1, "Ivo")]


def test_the_same_high_point_arrives_once(public: World) -> None:
    contest = running(public, **LEAD)
    jana, event = contest.entry("Jana"), uuid4()
    words: dict[str, Any] = {"number": 7, "made_at": "2026-11-29T10:00:00Z", "event": event}
    sent = [contest.say(jana, "high", 0, 1, hold=9, seconds=60, **words) for _ in range(2)]
    assert [answer.status_code for answer in sent] == [201, 200]
    other = contest.say(jana, "high", 0, 1, hold=9, plus=True, seconds=60, **words)
    assert other.status_code == 409
    assert [sent[0].json()[name] for name in ("hold", "plus", "seconds")] == [9, False, 60]


@pytest.mark.parametrize(
    ("kind", "words", "code"),
    [
        ("high", {"hold": 41}, "event-hold-beyond"),
        ("high", {}, "event-needs-hold"),
        ("high", {"hold": 9, "seconds": 3_601}, "event-time-long"),
        ("top", {"hold": 9}, "event-hold-of-high"),
        ("top", {"plus": True}, "event-hold-of-high"),
        ("zone", {}, "event-of-lead"),
        ("attempt", {}, "event-of-lead"),
        ("void", {"seconds": 9}, "event-time-of-high"),
    ],
)
def test_impossible_results_on_a_route_are_refused(
    public: World, kind: str, words: dict[str, Any], code: str
) -> None:
    contest = running(public, **LEAD)
    entry = contest.entry("Jana")
    answer = contest.say(entry, kind, 0, 1, **words)
    assert (answer.status_code, answer.json()["code"]) == (422, code)
    assert contest.ranks() == [(None, "Jana")]


def test_a_boulder_round_takes_no_high_point(public: World) -> None:
    contest = running(public)
    entry = contest.entry("Jana")
    cases: tuple[tuple[str, dict[str, Any], str], ...] = (
        ("high", {"hold": 9}, "event-of-boulder"),
        ("top", {"seconds": 9}, "event-time-of-high"),
    )
    for kind, words, code in cases:
        answer = contest.say(entry, kind, 0, 1, **words)
        assert (answer.status_code, answer.json()["code"]) == (422, code)
    # Route B has no number of holds: any hold is possible there.
    contest = running(public, **LEAD)
    high(contest, contest.entry("Jana"), 1, "99")


def test_holds_are_summed_and_the_best_routes_count(public: World) -> None:
    given = fun(30, 40, 20, best=2) | {"self_entry": True, "self_scoring": True}
    contest = running(public, **given)
    body = {"category_id": contest.sheet["categories"][0]["id"]}
    mine = contest.ask("PUT", "/mine", body, "member").json()["entry"]["id"]
    ivo = contest.entry("Ivo")
    high(contest, mine, 0, "12+", who="member")
    high(contest, mine, 0, "14", n=2, who="member")  # the better attempt counts
    high(contest, mine, 2, "TOP", who="member")
    high(contest, ivo, 1, "33+")
    lines = contest.board()["categories"][0]["lines"]
    assert [(line["name"], line["points"]) for line in lines] == [("member", "34"), ("Ivo", "33.5")]
    marks = contest.ask("GET", "/mine", who="member").json()["marks"]
    assert [(m["tries"], m["hold"], m["plus"], m["top"]) for m in marks] == [
        (2, 14, False, None),
        (1, None, False, 1),
    ]


def test_a_top_needs_the_number_of_holds(public: World) -> None:
    contest = Contest(public, fun(30, None)).make()
    refused = contest.ask("PUT", "/state", {"state": "running"})
    assert (refused.status_code, refused.json()["code"]) == (409, "cup-holds-missing")
    rounds = [{name: contest.sheet["rounds"][0][name] for name in ("id", "name", "scoring")}]
    rounds[0]["problems"] = contest.sheet["rounds"][0]["problems"]
    categories = [
        {name: one[name] for name in ("id", "name")} for one in contest.sheet["categories"]
    ]
    sheet = {"categories": categories, "rounds": rounds}
    rounds[0]["problems"][1]["holds"] = 25
    assert contest.ask("PUT", "/sheet", sheet).is_success
    contest.move("running")
    rounds[0]["problems"][1]["holds"] = None
    assert contest.ask("PUT", "/sheet", sheet).json()["code"] == "cup-holds-missing"


def test_a_league_adds_holds_but_no_ranks(public: World) -> None:
    week = fun(30)["rounds"][0] | {"kind": "week"}
    ranked = week | {"scoring": {"rules": "ifsc-lead"}}
    league = {"name": "League", "format": "league", "categories": [{"name": "Open"}]}
    refused = Contest(public).ask("POST", "", league | {"rounds": [ranked]})
    assert (refused.status_code, refused.json()["code"]) == (422, "cup-league-points")
    contest = running(public, format="league", rounds=[week], team_size=1)
    high(contest, contest.entry("Jana", team="Blue"), 0, "11+")
    assert contest.board()["teams"][0]["points"] == "11.5"


def test_each_category_ranks_on_its_own_routes(public: World) -> None:
    """Two routes for each of two categories in one qualification."""
    women, men = str(uuid4()), str(uuid4())
    problems = [
        {"name": f"{name} {n}", "category_ids": [of]}
        for name, of in (("Women", women), ("Men", men))
        for n in (1, 2)
    ]
    given = {
        "categories": [{"id": women, "name": "Women"}, {"id": men, "name": "Men"}],
        "format": "rounds",
        "rounds": [LEAD["rounds"][0] | {"problems": problems}],  # type: ignore[operator]
    }
    contest = running(public, **given)
    jana, eva = contest.entry("Jana"), contest.entry("Eva")
    ivo = contest.entry("Ivo", category=1)
    high(contest, jana, 0, "10")
    high(contest, eva, 0, "9")
    high(contest, ivo, 2, "3")
    lines = [line for one in contest.board()["categories"] for line in one["lines"]]
    # Nobody has tried the second route, so both share the ranks 1 and 2 on it.
    assert [(line["name"], line["rank"], line["rounds"][0]["result"]) for line in lines] == [
        ("Jana", 1, "1.22"),
        ("Eva", 2, "1.73"),
        ("Ivo", 1, "1.00"),
    ]
    assert [(high["high"], high["rank"]) for high in lines[0]["rounds"][0]["highs"].values()] == [
        ("10", "1"),
        ("", "1.5"),
    ]
    refused = contest.say(ivo, "high", 0, 1, hold=3)
    assert refused.json()["code"] == "cup-other-category"


@given(sheets(), st.integers(1, 40))
@settings(max_examples=20, deadline=None)
def test_a_board_ranks_the_routes_of_a_category_once(sheet: Sheet, number: int) -> None:
    """Events between two boards cost one ranking of each round and category that they touch."""
    board = Leaderboard(sheet)
    ranked: list[Any] = []
    original = Results._ranked_routes

    def counted(self: Results, one: Any, category: UUID) -> Any:
        ranked.append((one.id, category))
        return original(self, one, category)

    problems = [task.id for one in sheet.rounds for task in one.problems]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Results, "_ranked_routes", counted)
        for n in range(number):
            who, problem = sheet.entries[n % len(sheet.entries)].id, problems[n % len(problems)]
            board.results.add([Fact(key(21, n), who, problem, Kind.HIGH, 1, hold=n % 5)])
        board.lines()
    assert len(ranked) == len(set(ranked))
