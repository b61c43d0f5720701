"""A judge's event is struck by judges alone, and a round that is over stays as it is."""

from __future__ import annotations

from datetime import timedelta
from typing import Any
from uuid import UUID, uuid4

import pytest
from gym.tests.competitions.contest import Contest
from gym.tests.server.test_gym_transactions import statements
from gym.tests.worlds import World, make_world
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import update

from walltopo.core import WalltopoError
from walltopo_gym.clock import now
from walltopo_gym.competitions import judging
from walltopo_gym.competitions.bodies import EventBody
from walltopo_gym.competitions.history import board_of, marks_of, struck_events
from walltopo_gym.competitions.judging import MAX_CHAIN, Account, store_event
from walltopo_gym.competitions.ledger import Kind
from walltopo_gym.competitions.models import Competition, Round, ScoreEvent

NIGHT = [
    {"name": name, "scoring": {"rules": "points"}, "problems": [{"name": "A"}, {"name": "B"}]}
    for name in ("First", "Second")
]


@pytest.fixture
def public(world: World) -> World:
    """A gym that everybody sees."""
    return make_world(world.server, world.people, visibility="public")


def self_scored(world: World, **words: Any) -> tuple[Contest, str]:
    """A running competition that the member has entered, and the member's entry."""
    given = {"self_entry": True, "self_scoring": True} | words
    contest = Contest(world, given).make()
    contest.move("running")
    body = {"category_id": contest.sheet["categories"][0]["id"]}
    mine: str = contest.ask("PUT", "/mine", body, "member").json()["entry"]["id"]
    return contest, mine


def points(contest: Contest) -> str:
    answer: str = contest.board()["categories"][0]["lines"][0]["points"]
    return answer


def counted(contest: Contest, event: str) -> bool:
    items = contest.ask("GET", "/events", who="judge").json()["items"]
    found: bool = next(item["counts"] for item in items if item["id"] == event)
    return found


def test_an_appeal_strikes_nothing(public: World) -> None:
    contest, mine = self_scored(public)
    top = contest.say(mine, "top", 0, 1, who="member").json()["id"]
    undo = contest.say(mine, "void", 0, target_id=top).json()["id"]
    out = contest.say(mine, "out", text="climbed on the start list").json()["id"]
    for target in (undo, out):
        words: dict[str, Any] = {"target_id": target, "text": "I did top it"}
        appeal = contest.say(mine, "appeal", who="member", **words)
        assert appeal.status_code == 201
        assert counted(contest, target)
        assert counted(contest, appeal.json()["id"])
    assert contest.ranks() == [(None, "member")]
    contest.say(mine, "void", target_id=out)
    assert points(contest) == ""


def refused(answer: Any) -> None:
    assert (answer.status_code, answer.json().get("code")) == (403, "cup-judge-struck")


@pytest.mark.parametrize("correction", [("void", None, None), ("zone", 0, 1), ("attempt", 0, 2)])
def test_a_result_that_a_judge_struck_is_not_entered_again(
    public: World, correction: tuple[str, int | None, int | None]
) -> None:
    contest, mine = self_scored(public)
    top = contest.say(mine, "top", 0, 1, who="member").json()["id"]
    strike = contest.say(mine, *correction, target_id=top).json()["id"]
    after = points(contest)
    for kind, n in (("top", 1), ("top", 2), ("zone", 1), ("attempt", 1)):
        refused(contest.say(mine, kind, 0, n, who="member"))
    refused(contest.say(mine, "top", 0, 1, who="member", target_id=top))
    assert points(contest) == after
    # Other problems, appeals, and what judges enter.
    assert contest.say(mine, "top", 1, 1, who="member").status_code == 201
    assert contest.say(mine, "appeal", 0, who="member", text="I did").status_code == 201
    assert contest.say(mine, "zone", 0, 3).status_code == 201
    # The judge takes it back: the result counts again, and the climber enters what follows.
    back = contest.say(mine, "void", target_id=strike).json()["id"]
    assert counted(contest, top)
    assert contest.say(mine, "top", 0, 2, who="member").status_code == 201
    # And strikes it once more, by striking that.
    assert contest.say(mine, "void", target_id=back).status_code == 201
    refused(contest.say(mine, "top", 0, 1, who="member"))


def test_no_chain_of_own_events_brings_a_struck_result_back(public: World) -> None:
    contest, mine = self_scored(public)
    first = contest.say(mine, "top", 0, 2, who="member").json()["id"]
    second = contest.say(mine, "top", 0, 1, who="member").json()["id"]
    undo = contest.say(mine, "void", target_id=first, who="member").json()["id"]
    contest.say(mine, "void", target_id=second)
    for kind, which, n in (("void", None, None), ("void", 1, None), ("top", 1, 1)):
        refused(contest.say(mine, kind, which, n, target_id=undo, who="member"))
    assert points(contest) == ""
    # An undo of what a climber entered elsewhere is still theirs.
    other = contest.say(mine, "top", 1, 1, who="member").json()["id"]
    own = contest.say(mine, "void", target_id=other, who="member").json()["id"]
    assert contest.say(mine, "void", target_id=own, who="member").status_code == 201
    assert counted(contest, other)


def test_what_no_judge_struck_is_entered_again(public: World) -> None:
    contest, mine = self_scored(public)
    top = contest.say(mine, "top", 0, 1, who="member").json()["id"]
    assert contest.say(mine, "void", target_id=top, who="member").status_code == 201
    assert contest.say(mine, "top", 0, 1, who="member").status_code == 201
    # A judge who strikes an event of their own strikes nothing of the climber's.
    judged = contest.say(mine, "top", 1, 1).json()["id"]
    assert contest.say(mine, "void", target_id=judged).status_code == 201
    assert contest.say(mine, "top", 1, 2, who="member").status_code == 201


def close(contest: Contest, number: int) -> None:
    """A round was over two hours ago, later than late results may arrive."""
    one = Round.id == UUID(contest.sheet["rounds"][number]["id"])
    with contest.world.server.database.writing() as session:
        over = now() - timedelta(hours=2)
        session.execute(update(Round).where(one).values(state="ended", closes_at=over))


@pytest.mark.parametrize("form", ["festival", "night"])
def test_a_void_without_a_problem_is_in_the_round_of_what_it_strikes(
    public: World, form: str
) -> None:
    rounds = NIGHT[:1]
    contest, mine = self_scored(public, format=form, rounds=rounds)
    top = contest.say(mine, "top", 0, 1, who="member").json()["id"]
    undo = contest.say(mine, "void", 0, target_id=top, who="member").json()["id"]
    close(contest, 0)
    for target in (undo, top):
        for which in (None, 0):
            late = contest.say(mine, "void", which, target_id=target, who="member")
            assert late.status_code == 409, late.text
            assert late.json()["code"] == "cup-round-over"
    assert points(contest) == ""


def test_an_event_in_an_open_round_strikes_nothing_in_a_round_that_is_over(public: World) -> None:
    contest, mine = self_scored(public, format="rounds", rounds=NIGHT)
    top = contest.say(mine, "top", 0, 1, who="member").json()["id"]
    undo = contest.say(mine, "void", 0, target_id=top, who="member").json()["id"]
    assert contest.move_round(0, "ended").is_success
    assert contest.move_round(1, "running").is_success
    close(contest, 0)
    for kind, n in (("void", None), ("top", 1)):
        late = contest.say(mine, kind, 0, n, target_id=undo, who="member", one=1)
        assert late.status_code == 409, late.text
    assert not counted(contest, top)
    # Events of the open round alone are still the climber's to change.
    own = contest.say(mine, "top", 0, 2, who="member", one=1).json()["id"]
    assert contest.say(mine, "void", target_id=own, who="member").status_code == 201


def test_whom_the_gym_withdrew_does_not_enter_again(public: World) -> None:
    contest, mine = self_scored(public)
    body = {"category_id": contest.sheet["categories"][0]["id"]}
    # A climber who withdrew comes back.
    assert contest.ask("DELETE", "/mine", who="member").is_success
    assert contest.ask("PUT", "/mine", body, "member").is_success
    assert contest.ask("PATCH", f"/entries/{mine}", {"withdrawn": True}).is_success
    for _ in range(2):
        refused = contest.ask("PUT", "/mine", body, "member")
        assert (refused.status_code, refused.json()["code"]) == (403, "cup-gym-withdrew")
        contest.ask("DELETE", "/mine", who="member")
    assert contest.say(mine, "top", 0, 1, who="member").status_code == 409
    # The gym lets them in again.
    assert contest.ask("PATCH", f"/entries/{mine}", {"withdrawn": False}).is_success
    assert contest.ask("PUT", "/mine", body, "member").is_success


def voided(contest: Contest, mine: str, times: int) -> tuple[str, Any]:
    """A climber's top, and the last answer to voids that each strike the event before."""
    top = contest.say(mine, "top", 0, 1, who="member")
    answer = top
    for _ in range(times):
        target = answer.json()["id"]
        answer = contest.say(mine, "void", 0, target_id=target, who="member")
        if not answer.is_success:
            break
    return top.json()["id"], answer


def test_a_climber_cannot_void_voids_without_limit(public: World) -> None:
    contest, mine = self_scored(public)
    top, last = voided(contest, mine, MAX_CHAIN)
    assert last.status_code == 201
    _, refused = voided(contest, mine, MAX_CHAIN + 1)
    assert (refused.status_code, refused.json()["code"]) == (409, "event-chain")
    # A judge decides by one event, whatever hangs on the top; an appeal is always possible.
    was = counted(contest, top)
    assert contest.say(mine, "void", 0, target_id=top).status_code == 201
    assert (was, counted(contest, top)) == (True, False)
    end = last.json()["id"]
    assert contest.say(mine, "appeal", target_id=end, text="no", who="member").status_code == 201


def test_the_events_of_a_chain_are_read_in_one_query(public: World) -> None:
    contest, mine = self_scored(public)
    numbers = []
    for times in (2, MAX_CHAIN - 1):
        _, last = voided(contest, mine, times)
        with statements(public.server) as executed:
            contest.say(mine, "void", 0, target_id=last.json()["id"], who="member")
        numbers.append(len(executed))
    assert numbers[0] == numbers[1]


def test_a_climbers_events_on_a_problem_have_a_limit_and_a_judges_come_after_it(
    public: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(judging, "MAX_OWN_EVENTS", 3)
    monkeypatch.setattr(judging, "MAX_EVENTS", 4)
    contest, mine = self_scored(public)
    for n in range(1, 4):
        assert contest.say(mine, "attempt", 0, n, who="member").status_code == 201
    refused = contest.say(mine, "attempt", 0, 4, who="member")
    assert (refused.status_code, refused.json()["code"]) == (409, "event-too-many")
    assert contest.say(mine, "attempt", 1, 1, who="member").status_code == 201
    assert contest.say(mine, "top", 0, 4).status_code == 201
    assert contest.say(mine, "top", 0, 5).json()["code"] == "event-too-many"


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(list(Kind)),
        st.none() | st.integers(0, 1),
        st.none() | st.integers(0, 3),
        st.none() | st.integers(0, 20),
    ),
    max_size=8,
)


@given(events=EVENTS)
@settings(max_examples=60)
def test_no_events_of_a_competitor_change_whether_a_judges_event_counts(
    judged: tuple[Contest, str, list[UUID]],
    events: list[tuple[Kind, int | None, int | None, int | None]],
) -> None:
    """Kind, problem, number of the try, and which earlier event it names: any of them."""
    contest, mine, known = judged
    person = contest.person("member").id
    assert person is not None
    with contest.world.server.database.writing() as session:
        row = session.get_one(Competition, UUID(contest.sheet["id"]))
        by_judge = known[1:]
        before = struck_events(session, row.id, by_judge)
        outs = dict(board_of(session, row).results.outs)
        of_struck = ScoreEvent.problem_id == UUID(contest.problem(0))
        marks = marks_of(session, row.id, of_struck)
        there = list(known)
        for number, (kind, which, n, target) in enumerate(events):
            at = now()
            proposal = EventBody.model_construct(
                entry_id=UUID(mine),
                problem_id=None if which is None else UUID(contest.problem(which)),
                kind=kind,
                n=n,
                target_id=None if target is None else there[target % len(there)],
                text="",
                device="phone",
                number=number,
                made_at=at,
                sent_at=at,
            )
            event = uuid4()
            try:
                store_event(session, row, event, proposal, Account(person))
            except WalltopoError:
                continue
            there.append(event)
        assert struck_events(session, row.id, by_judge) == before
        assert board_of(session, row).results.outs == outs
        assert marks_of(session, row.id, of_struck) == marks
        session.rollback()


@pytest.fixture
def judged(public: World) -> tuple[Contest, str, list[UUID]]:
    """A competition with an own event of the member, the first, and one of each kind of a judge."""
    contest, mine = self_scored(public)
    own = contest.say(mine, "top", 0, 1, who="member").json()["id"]
    ids = [own]
    for kind, which, n, target in (
        ("void", 0, None, own),
        ("zone", 0, 2, own),
        ("attempt", 1, 1, None),
        ("out", None, None, None),
        ("void", None, None, "out"),
        ("out", None, None, None),
    ):
        words: dict[str, Any] = {"target_id": ids[-1] if target == "out" else target}
        ids.append(contest.say(mine, kind, which, n, **words).json()["id"])
    appeal = contest.say(mine, "appeal", who="member", text="no").json()["id"]
    ids.append(contest.say(mine, "decision", n=0, target_id=appeal).json()["id"])
    return contest, mine, [UUID(event) for event in ids]
