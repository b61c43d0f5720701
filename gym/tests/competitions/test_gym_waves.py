"""Waves of a self-scored round, limits of attempts, and planned starts."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any

import pytest
from gym.tests.competitions.contest import PROBLEMS, Contest
from gym.tests.worlds import World, make_world
from tests.at_once import at_once

from walltopo_gym.clock import now


@pytest.fixture
def public(world: World) -> World:
    """A gym that everybody sees."""
    return make_world(world.server, world.people, visibility="public")


def a_wave(name: str, begins: float, ends: float, places: int | None = None) -> dict[str, Any]:
    """A wave between two moments, in minutes from now."""
    at = now()
    return {
        "name": name,
        "starts_at": (at + timedelta(minutes=begins)).isoformat(),
        "ends_at": (at + timedelta(minutes=ends)).isoformat(),
        "places": places,
    }


def a_round(**words: Any) -> dict[str, Any]:
    problems = [{"name": name} for name in PROBLEMS]
    return {"name": "Session", "scoring": {"rules": "points"}, "problems": problems} | words


def in_waves(world: World, *waves: dict[str, Any], state: str = "running") -> Contest:
    words = {"self_entry": True, "self_scoring": True, "rounds": [a_round(waves=list(waves))]}
    contest = Contest(world, words).make()
    contest.move(state)
    return contest


def wave_of(contest: Contest, number: int) -> str:
    found: str = contest.sheet["rounds"][0]["waves"][number]["id"]
    return found


def enter(contest: Contest, wave: int | None, who: str = "member") -> Any:
    category = contest.sheet["categories"][0]["id"]
    chosen = None if wave is None else wave_of(contest, wave)
    return contest.ask("PUT", "/mine", {"category_id": category, "wave_id": chosen}, who)


def code(answer: Any) -> str:
    assert answer.status_code in (409, 422), answer.text
    found: str = answer.json()["code"]
    return found


def test_people_choose_a_wave_with_free_places(public: World) -> None:
    early, late = a_wave("A", -30, 30, places=1), a_wave("B", 30, 90)
    contest = in_waves(public, early, late, a_wave("Over", -90, -30), state="open")
    assert code(enter(contest, None)) == "cup-choose-wave"
    assert code(enter(contest, 2)) == "cup-wave-over"
    assert enter(contest, 0).json()["entry"]["wave_id"] == wave_of(contest, 0)
    assert enter(contest, 0).is_success  # one's own place is no other's
    assert code(enter(contest, 0, "judge")) == "cup-wave-full"
    assert enter(contest, 1, "judge").is_success
    assert code(enter(contest, 1)) == "cup-wave-stays"  # it has begun
    waves = contest.ask("GET", "", who="member").json()["rounds"][0]["waves"]
    assert [(wave["name"], wave["entries"]) for wave in waves] == [("A", 1), ("B", 1), ("Over", 0)]
    # The gym may add somebody to a full wave, and put somebody into another one or into none.
    other = contest.entry("Ivo", wave_id=wave_of(contest, 0))
    for wave in (wave_of(contest, 1), None):
        changed = contest.ask("PATCH", f"/entries/{other}", {"wave_id": wave})
        assert changed.json()["wave_id"] == wave


def test_of_two_who_want_the_last_place_one_gets_it(public: World) -> None:
    contest = in_waves(public, a_wave("A", 0, 30, places=1), state="open")
    answers = at_once(*(lambda who=who: enter(contest, 0, who) for who in ("member", "judge")))
    assert sorted(answer.status_code for answer in answers) == [200, 409]


def test_scores_count_in_ones_wave_and_arrive_late(public: World) -> None:
    contest = in_waves(public, a_wave("A", -60, -5), a_wave("B", 5, 60))
    other = contest.entry("Ivo", wave_id=wave_of(contest, 1))
    member = {"category_id": contest.sheet["categories"][0]["id"], "wave_id": wave_of(contest, 1)}
    mine = contest.ask("PUT", "/mine", member, "member").json()["entry"]["id"]

    def score(ago: float) -> Any:
        """The member tops a problem so many minutes ago."""
        made = (now() - timedelta(minutes=ago)).isoformat()
        return contest.say(mine, "top", 0, 1, who="member", made_at=made, sent_at=now().isoformat())

    assert code(score(0)) == "cup-wave-not-begun"
    for wave in (wave_of(contest, 0), None):
        assert contest.ask("PATCH", f"/entries/{mine}", {"wave_id": wave}).is_success
        if wave is None:
            assert code(score(10)) == "cup-no-wave"
        else:
            assert code(score(0)) == "cup-wave-over"
            assert score(10).status_code == 201  # climbed in time, arrived within the hour
    # Judges enter results at any time.
    assert contest.say(other, "top", 0, 1).status_code == 201


def test_late_results_of_a_wave_have_an_end(public: World) -> None:
    contest = in_waves(public, a_wave("A", -200, -90))
    mine = contest.entry("Mina", wave_id=wave_of(contest, 0))
    category = {"category_id": contest.sheet["categories"][0]["id"]}
    assert code(contest.ask("PUT", "/mine", category, "member")) == "cup-choose-wave"
    assert contest.say(mine, "top", 0, 1).status_code == 201


def test_who_withdrew_in_a_wave_comes_back_to_it_alone(public: World) -> None:
    contest = in_waves(public, a_wave("A", -60, -1, places=1), a_wave("B", 5, 60))
    category = {"category_id": contest.sheet["categories"][0]["id"]}
    assert enter(contest, 1).is_success
    mine = contest.ask("GET", "/mine", who="member").json()["entry"]["id"]
    in_first = {"wave_id": wave_of(contest, 0)}
    assert contest.ask("PATCH", f"/entries/{mine}", in_first).is_success
    assert contest.ask("DELETE", "/mine", who="member").is_success
    for wave in (1, None):  # nobody climbs in two waves
        assert code(enter(contest, wave)) == "cup-wave-stays"
    entry = enter(contest, 0).json()["entry"]
    assert (entry["withdrawn"], entry["wave_id"]) == (False, wave_of(contest, 0))
    # Judges enter all results from now on: nobody chooses a wave.
    assert contest.ask("PATCH", "", {"self_scoring": False}).is_success
    assert contest.ask("PUT", "/mine", category, "judge").is_success


@pytest.mark.parametrize(
    ("form", "begins", "ends", "reason"),
    [
        ("festival", 0, -30, "cup-wave-ends-before"),
        ("league", 0, 30, "cup-waves-first"),
        ("festival", -90, 30, "cup-wave-outside"),
        ("festival", 0, 90, "cup-wave-outside"),
    ],
)
def test_waves_that_cannot_be(
    public: World, form: str, begins: float, ends: float, reason: str
) -> None:
    limits = a_wave("", -60, 60)
    one = a_round(
        waves=[a_wave("A", begins, ends)],
        opens_at=limits["starts_at"],
        closes_at=limits["ends_at"],
    )
    body = {"name": "Cup", "format": form, "categories": [{"name": "Open"}], "rounds": [one]}
    assert code(Contest(public).ask("POST", "", body)) == reason


def test_a_wave_with_entries_is_not_deleted(public: World) -> None:
    contest = in_waves(public, a_wave("A", 0, 30), state="open")
    ivo = contest.entry("Ivo", wave_id=wave_of(contest, 0))
    sheet = {name: contest.sheet[name] for name in ("categories", "rounds")}
    sheet["categories"] = [{"id": one["id"], "name": one["name"]} for one in sheet["categories"]]
    one = sheet["rounds"][0]
    kept = [{"id": problem["id"]} for problem in one["problems"]]
    sheet["rounds"] = [a_round()]  # another round
    assert code(contest.ask("PUT", "/sheet", sheet)) == "cup-used"
    sheet["rounds"] = [a_round(id=one["id"], problems=kept)]
    assert code(contest.ask("PUT", "/sheet", sheet)) == "cup-used"
    assert contest.ask("PATCH", f"/entries/{ivo}", {"withdrawn": True}).is_success
    assert contest.ask("PUT", "/sheet", sheet).is_success


def test_attempts_end_and_do_not_count_beyond_the_limit(public: World) -> None:
    one = a_round(scoring={"rules": "ifsc-2018"}, max_attempts=3)
    contest = Contest(public, {"rounds": [one], "self_scoring": True, "self_entry": True}).make()
    contest.move("running")
    jana, ivo = contest.entry("Jana"), contest.entry("Ivo")
    assert contest.say(jana, "top", 0, 3).status_code == 201
    assert contest.say(ivo, "zone", 0, 2).status_code == 201
    refused = contest.say(ivo, "top", 0, 4)
    assert code(refused) == "event-attempts"
    assert refused.json()["values"] == {"count": "3", "round": "Session"}
    assert code(contest.say(ivo, "attempt", 1, 4, who="judge")) == "event-attempts"
    assert contest.ranks() == [(1, "Jana"), (2, "Ivo")]
    # With a lower limit the third attempt does not count any more; the ledger keeps it.
    sheet = {
        "categories": [{"id": contest.sheet["categories"][0]["id"], "name": "Open"}],
        "rounds": [
            one
            | {
                "id": contest.sheet["rounds"][0]["id"],
                "max_attempts": 2,
                "problems": [{"id": contest.problem(n)} for n in range(len(PROBLEMS))],
            }
        ],
    }
    assert contest.ask("PUT", "/sheet", sheet).is_success
    assert contest.ranks() == [(1, "Ivo"), (None, "Jana")]
    path = f"/problems/{contest.problem(0)}/marks"
    marks = {mark["entry_id"]: mark for mark in contest.ask("GET", path, who="judge").json()}
    assert set(marks) == {ivo}
    events = contest.ask("GET", "/events", who="judge").json()["items"]
    assert [(event["n"], event["counts"]) for event in events] == [(3, True), (2, True)]


def test_a_climber_has_no_attempts_left_either(public: World) -> None:
    one = a_round(max_attempts=1)
    contest = Contest(public, {"rounds": [one], "self_scoring": True, "self_entry": True}).make()
    contest.move("running")
    category = {"category_id": contest.sheet["categories"][0]["id"]}
    mine = contest.ask("PUT", "/mine", category, "member").json()["entry"]["id"]
    assert code(contest.say(mine, "top", 0, 2, who="member")) == "event-attempts"
    assert contest.say(mine, "top", 0, 1, who="member").status_code == 201


def test_planned_starts_follow_the_running_order(public: World) -> None:
    begins = now().replace(microsecond=0) + timedelta(hours=1)
    one = a_round(opens_at=begins.isoformat(), rotation_seconds=300, isolation_minutes=45)
    contest = Contest(public, {"rounds": [one]}).make()
    assert contest.sheet["rounds"][0]["isolation_minutes"] == 45
    for name in ("Ada", "Bea", "Cleo"):
        contest.entry(name)
    path = f"/rounds/{contest.sheet['rounds'][0]['id']}/starters"
    starts = [datetime.fromisoformat(one["starts_at"]) for one in contest.ask("GET", path).json()]
    assert starts == [begins + timedelta(minutes=5 * n) for n in range(3)]
