"""The log of a person: filters, months and years, counted from all climbs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, timedelta
from typing import Final
from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.climbing.kinds import FIRST_TRIES, TOPS
from walltopo_gym.events import LoggedClimb, LoggedClimbs, collect_answers
from walltopo_gym.texts import same_key

_SLACK: Final = timedelta(days=2)  # a gym's day begins and ends at other moments than one of UTC


@dataclass(frozen=True)
class LogFilter:
    """Conditions on the entries of a log; an empty field accepts all.

    Parameters
    ----------
    words : each of them stands in the name, the note or the location.
    """

    location: str = ""
    grade: str = ""
    colour: str = ""
    steepness: str = ""
    kind: str = ""
    discipline: str = ""
    words: str = ""

    def wants(self, climb: LoggedClimb) -> bool:
        """Return whether an entry passes."""
        exact = (
            (self.location, climb.location),
            (self.grade, climb.grade),
            (self.colour, climb.colour),
            (self.steepness, climb.steepness),
            (self.kind, climb.kind),
            (self.discipline, climb.discipline),
        )
        if any(wanted and wanted != value for wanted, value in exact):
            return False
        text = same_key(f"{climb.name} {climb.note} {climb.location}")
        return all(word in text for word in same_key(self.words).split())


@dataclass
class Totals:
    """Sums over some entries; `days`: on which the person climbed."""

    ascents: int = 0
    tops: int = 0
    flashes: int = 0
    days: int = 0


@dataclass
class Choices:
    """The values by which a person's whole log can be filtered, each in the order of its number."""

    locations: list[str] = field(default_factory=list)
    grades: list[str] = field(default_factory=list)
    colours: list[str] = field(default_factory=list)
    steepness: list[str] = field(default_factory=list)
    kinds: list[str] = field(default_factory=list)
    disciplines: list[str] = field(default_factory=list)


def climbs_of(session: Session, person: UUID) -> list[LoggedClimb]:
    """Return all entries of a person's log, the latest first."""
    return _latest_first(collect_answers(session, LoggedClimbs(person)))


def climbs_of_month(
    session: Session, person: UUID, year: int, month: int, wanted: LogFilter
) -> list[LoggedClimb]:
    """Return the entries of a month that pass a filter, the latest first."""
    begin = datetime(year, month, 1, tzinfo=UTC)
    end = datetime(year + month // 12, month % 12 + 1, 1, tzinfo=UTC)
    found = collect_answers(session, LoggedClimbs(person, begin - _SLACK, end + _SLACK))
    return _latest_first(
        climb
        for climb in found
        if (climb.day.year, climb.day.month) == (year, month) and wanted.wants(climb)
    )


def _latest_first(climbs: Iterable[LoggedClimb]) -> list[LoggedClimb]:
    return sorted(climbs, key=lambda climb: (climb.day, climb.at, climb.id), reverse=True)


def totals_of(climbs: Iterable[LoggedClimb]) -> Totals:
    """Return the sums over some entries."""
    totals = Totals()
    days: set[date] = set()
    for climb in climbs:
        totals.ascents += 1
        totals.tops += climb.kind in TOPS
        totals.flashes += climb.kind in FIRST_TRIES
        days.add(climb.day)
    totals.days = len(days)
    return totals


def months_of(climbs: Iterable[LoggedClimb]) -> list[tuple[str, Totals]]:
    """Return the sums of each month ("2026-03") with entries, the latest first."""
    sorted_in: dict[str, list[LoggedClimb]] = {}
    for climb in climbs:
        sorted_in.setdefault(f"{climb.day:%Y-%m}", []).append(climb)
    return [(month, totals_of(sorted_in[month])) for month in sorted(sorted_in, reverse=True)]


def choices_of(climbs: Sequence[LoggedClimb]) -> Choices:
    """Return the values by which these entries can be filtered."""
    return Choices(
        locations=_by_number(climb.location for climb in climbs),
        grades=_by_number(climb.grade for climb in climbs),
        colours=_by_number(climb.colour for climb in climbs),
        steepness=_by_number(climb.steepness for climb in climbs),
        kinds=_by_number(climb.kind for climb in climbs),
        disciplines=_by_number(climb.discipline for climb in climbs),
    )


def _by_number(values: Iterable[str]) -> list[str]:
    counts = Counter(value for value in values if value)
    return sorted(counts, key=lambda value: (-counts[value], value))


@dataclass
class Year:
    """A person's year.

    Parameters
    ----------
    months : tops of January to December. grades, locations : label and number of tops, the
        commonest first. streak : weeks in a row with a climbing day.
    """

    totals: Totals
    months: list[int]
    grades: list[tuple[str, int]]
    locations: list[tuple[str, int]]
    streak: int


_SHOWN: Final = 8


def year_of(climbs: Iterable[LoggedClimb], year: int) -> Year:
    """Return the figures of a calendar year."""
    own = [climb for climb in climbs if climb.day.year == year]
    tops = [climb for climb in own if climb.kind in TOPS]
    by_month = Counter(climb.day.month for climb in tops)
    grades = Counter(climb.grade for climb in tops if climb.grade)
    locations = Counter(climb.location for climb in tops if climb.location)
    return Year(
        totals=totals_of(own),
        months=[by_month[month] for month in range(1, 13)],
        grades=_most_common(grades),
        locations=_most_common(locations),
        streak=_longest_streak({climb.day - timedelta(climb.day.weekday()) for climb in own}),
    )


def _most_common(counts: Counter[str]) -> list[tuple[str, int]]:
    return sorted(counts.items(), key=lambda pair: (-pair[1], pair[0]))[:_SHOWN]


def _longest_streak(mondays: set[date]) -> int:
    longest = run = 0
    before: date | None = None
    for monday in sorted(mondays):
        run = run + 1 if before is not None and monday - before == timedelta(7) else 1
        longest, before = max(longest, run), monday
    return longest
