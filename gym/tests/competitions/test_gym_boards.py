"""The board, kept event by event, is what a slow scorer makes of all events at once."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from fractions import Fraction
from random import Random
from uuid import UUID

import pytest
from gym.tests.competitions.reference import Reference
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo_gym.clock import now
from walltopo_gym.competitions.board import Leaderboard
from walltopo_gym.competitions.ledger import Fact, Kind, Ledger
from walltopo_gym.competitions.ranking import ranks_by_key
from walltopo_gym.competitions.scoring.formulas import score_2018, score_2025
from walltopo_gym.competitions.scoring.rules import Scoring
from walltopo_gym.competitions.scoring.score import NOTHING, AttemptedProblem, Mark
from walltopo_gym.competitions.sheet import Competitor, Format, RoundSheet, Sheet, Task

RULES = ("points", "shared", "ifsc-2025", "ifsc-2018", "most", "ifsc-lead", "lead-points")
NO_SUM = ("ifsc-2018", "ifsc-lead")
CATEGORIES = (UUID(int=1), UUID(int=2))


def key(kind: int, number: int) -> UUID:
    return UUID(int=1000 * kind + number)


ENTRIES = tuple(
    Competitor(
        key(2, n),
        CATEGORIES[n % 2],
        n + 1,
        f"Climber {n}",
        ("", "Blue", "Red")[n % 3],
        "",
        10 * (n % 2),
    )
    for n in range(7)
)


@st.composite
def sheets(draw: st.DrawFn) -> Sheet:
    """A competition of one or two rounds that have begun; to the second not all may come."""
    form = draw(st.sampled_from(list(Format)))
    rules = [r for r in RULES if form != Format.LEAGUE or r not in NO_SUM]
    rounds = []
    for number in range(1 if form in (Format.FESTIVAL, Format.NIGHT) else 2):
        tasks = tuple(
            Task(
                key(3 + number, n),
                str(n),
                "red",
                draw(st.sampled_from([None, {"flash": 9, "top": 7, "zone": 3}])),
                frozenset(CATEGORIES[:1]) if n == 3 else frozenset(),
                5,
            )
            for n in range(draw(st.sampled_from([1, 4])))
        )
        scoring = Scoring.of(
            {
                "rules": draw(st.sampled_from(rules)),
                "best": draw(st.sampled_from([None, 2])),
                "zone": 10,
            }
        )
        is_final = number == 1 and form == Format.ROUNDS
        starters = frozenset(who.id for who in ENTRIES[:4]) if is_final else None
        rounds.append(
            RoundSheet(
                key(9, number),
                f"Round {number}",
                draw(st.sampled_from(["open", "final"])),
                "running",
                scoring,
                4 if is_final else None,
                now(),
                tasks,
                starters,
            )
        )
    return Sheet(
        key(1, 1),
        "Cup",
        form,
        "running",
        1,
        None,
        draw(st.sampled_from([None, 1])),
        2,
        tuple((category, str(category)) for category in CATEGORIES),
        tuple(rounds),
        ENTRIES,
    )


def seen(sheet: Sheet, chance: Random) -> list[Fact]:
    """Yield events of judges and competitors, some of them about earlier ones."""
    problems = [task.id for one in sheet.rounds for task in one.problems]
    facts: list[Fact] = []
    for number in range(chance.randrange(50)):
        kind = chance.choice(
            [
                "attempt",
                "zone",
                "top",
                "top",
                "zone",
                "void",
                "void",
                "out",
                "appeal",
                *4 * ["high"],
            ]
        )
        entry = chance.choice(sheet.entries).id
        target = chance.choice(facts) if facts and chance.random() < 0.3 else None
        if kind == "void" and target is None:
            kind = "attempt"
        if target is not None:
            entry = target.entry
        problem = None if kind in ("out", "appeal") else chance.choice(problems)
        n = chance.randrange(1, 5) if kind in ("attempt", "zone", "top", "high") else None
        facts.append(
            Fact(
                key(20, number),
                entry,
                problem,
                kind,
                n,
                None if target is None else target.id,
                "why",
                chance.randrange(6) if kind == "high" else None,
                kind == "high" and chance.random() < 0.5,
                chance.choice([None, 90, 120]) if kind in ("top", "high") else None,
            )
        )
    return facts


def ranks(board: Leaderboard) -> dict[UUID, int | None]:
    return {line.entry_id: line.rank for lines in board.lines().values() for line in lines}


@given(sheets(), st.integers(0, 10**9))
@settings(max_examples=200, deadline=None)
def test_in_whatever_order_events_arrive_the_board_is_the_references(
    sheet: Sheet, seed: int
) -> None:
    chance = Random(seed)
    facts = seen(sheet, chance)
    arriving = facts + facts[::3]
    chance.shuffle(arriving)
    board = Leaderboard(sheet)
    for at in range(0, len(arriving), 7):
        board.results.add(arriving[at : at + 7])
        assert ranks(board) == Reference(sheet, arriving[: at + 7]).ranks()
    assert ranks(board) == Reference(sheet, facts).ranks()
    # Somebody withdraws and comes back, while the events stay.
    fewer = replace(sheet, entries=sheet.entries[1:])
    board.results.use(fewer)
    assert ranks(board) == Reference(fewer, facts).ranks()
    board.results.use(sheet)
    whole = Leaderboard(sheet)
    whole.results.add(facts)
    assert board.view() == whole.view()


@given(sheets(), st.integers(0, 10**9))
@settings(max_examples=60, deadline=None)
def test_why_one_stands_before_another(sheet: Sheet, seed: int) -> None:
    """The comparisons end in the one that decides, and it says the same as the ranks."""
    board = Leaderboard(sheet)
    board.results.add(seen(sheet, Random(seed)))
    found = ranks(board)
    for first in sheet.entries:
        for second in sheet.entries:
            if first.category != second.category:
                continue
            steps = board.compare(first.id, second.id)
            mine, theirs = found[first.id], found[second.id]
            if mine is None or theirs is None:
                assert steps == []
                continue
            assert [step.decides for step in steps[:-1]] == [False] * (len(steps) - 1)
            assert steps[-1].decides == (mine != theirs)


def test_equal_ranks_are_shared_and_the_next_is_as_much_later() -> None:
    keys = {name: (Fraction(value),) for name, value in zip("abcd", (5, 9, 5, 1), strict=True)}
    places = ranks_by_key(keys)
    assert [(name, places[name].rank, places[name].tied) for name in "badc"] == [
        ("b", 1, False),
        ("a", 2, True),
        ("d", 4, False),
        ("c", 2, True),
    ]


@pytest.mark.parametrize(
    ("marks", "points"),
    [
        # The worked example of the description that docs/competitions.md names: 59.7.
        ([Mark(1, 1, 1), Mark(3, 1, 3), Mark(2, 2, 0), Mark(4, 0, 0)], "597/10"),
        ([Mark(4, 2, 4)], "247/10"),
        ([Mark(999, 999, 0)], "0"),
        ([], "0"),
    ],
)
def test_points_of_2025(marks: list[Mark], points: str) -> None:
    tried = [AttemptedProblem(key(3, n), mark) for n, mark in enumerate(marks)]
    assert score_2025(tried).points == Fraction(points)


def test_before_2025_tops_then_zones_then_tries() -> None:
    better = [
        AttemptedProblem(key(3, 1), Mark(5, 5, 5)),
        AttemptedProblem(key(3, 2), Mark(1, 1, 0)),
    ]
    worse = [AttemptedProblem(key(3, 1), Mark(1, 1, 1)), AttemptedProblem(key(3, 2), Mark(9, 0, 0))]
    assert score_2018(better).key > score_2018(worse).key  # a zone more beats fewer tries
    assert [int(value) for value in score_2018(worse).key] == [1, 1, -1, -1]


def voids(number: int) -> list[Fact]:
    """A top, its void, the void of that, and so on."""
    entry, problem = key(1, 0), key(2, 0)
    top = Fact(key(3, 0), entry, problem, Kind.TOP, 1)
    return [top] + [
        Fact(key(3, n), entry, problem, Kind.VOID, target=key(3, n - 1)) for n in range(1, number)
    ]


def test_a_long_chain_of_voids_counts_as_its_length_says() -> None:
    ledger, facts = Ledger(), voids(1_002)
    for fact in facts:
        ledger.add([fact])
    assert not ledger.counts(facts[0].id)  # an odd number of voids
    assert ledger.mark(facts[0].entry, key(2, 0)) == NOTHING
    ledger.add(voids(1_003))
    assert ledger.mark(facts[0].entry, key(2, 0)) == Mark(1, 1, 1)


class Counted(Counter[UUID]):
    """Counts how often its numbers are changed."""

    changes = 0

    def __setitem__(self, event: UUID, number: int) -> None:
        self.changes += 1
        super().__setitem__(event, number)


@pytest.mark.parametrize("number", [1_000, 20_000])
def test_reading_a_long_chain_of_voids_costs_at_most_one_change_an_event(number: int) -> None:
    ledger = Ledger()
    ledger._strikers = counted = Counted()
    ledger.add(voids(number))
    assert counted.changes <= number
    assert ledger.counts(key(3, 0)) == (number % 2 == 1)
