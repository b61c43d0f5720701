"""Find which styles are climbed and liked by which groups, each of five people or more.

The period is the year up to the last Monday, so that two requests on one day do not reveal who came
in between. A climber's band is that of their hardest top of that year; bands and categories of
fewer than five are merged with the next.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final, NamedTuple

from sqlalchemy import String, case, cast, func, select
from sqlalchemy.orm import Session

from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.models import Profile
from walltopo_gym.climbing.kinds import TOPS
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.climbing.points import worth_of
from walltopo_gym.climbing.shrinking import NOTHING, Sample, shrunk_means
from walltopo_gym.climbing.styles import length_of, main_hold, steepness_of
from walltopo_gym.gyms.days import day_begins, gym_day, zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.insights.guard import People, Style, safe_to_show
from walltopo_gym.insights.usage import ENOUGH, what_counts
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.models import Wall

_YEAR: Final = timedelta(days=364)
# The first grade of each band but the first.
BANDS: Final = ("6A", "6C", "7B")
_NO_TOP: Final = "none"


@dataclass(frozen=True)
class Group:
    """Climbers of a band or a category, `size` of them. `parts`: the merged ones, such as ("0",
    "1") for the bands below 6A and from there to 6C, or ("men", "other")."""

    parts: tuple[str, ...]
    size: int

    @property
    def key(self) -> str:
        """Return its name in a table."""
        return "+".join(self.parts)


@dataclass
class StyleCell:
    """Counts of one style and group: tried and topped routes, each once per person; star votes and
    their mean."""

    tried: int | None
    topped: int | None
    votes: int | None
    stars: float | None


@dataclass
class StyleInsight:
    """Counts of a style (steepness, main hold type, colour, length): tried and topped routes, each
    once per person; star votes and their shrunk mean. `cells` by group. None: withheld, too few
    people."""

    kind: str
    value: str
    routes: int
    tried: int | None
    topped: int | None
    votes: int | None
    stars: float | None
    cells: dict[str, StyleCell]


@dataclass
class Styles:
    """Styles by group from `since` to `until`. With fewer than two `groups` there is no
    breakdown."""

    since: datetime
    until: datetime
    groups: list[Group]
    lines: list[StyleInsight]


class _Climbed(NamedTuple):
    """Whether a person topped a route that they tried. Both keys are text, which the database makes
    faster than Python makes UUIDs."""

    route: str
    person: str
    topped: bool
    worth: int


def styles(session: Session, gym: Gym, at: datetime, by: str) -> Styles:
    """Return styles by groups of climbers.

    Parameters
    ----------
    at : now; by : "bands" or "categories".
    """
    zone = zone_of(gym)
    today = gym_day(at, zone)
    until = day_begins(today - timedelta(days=today.weekday()), zone)
    since = until - _YEAR
    climbed = _read_tops(session, gym, since, until)
    routes = _route_styles(session, gym)
    groups = _groups_of_people(session, gym, climbed, by)
    of_person = {person: group.key for group, people in groups.items() for person in people}
    numbers = {person: number for number, person in enumerate(of_person)}
    votes = [
        (route, person, stars)
        for route, person, stars in _votes(session, gym, since, until)
        if person in of_person
    ]
    tried = _people(((one.route, one.person) for one in climbed), of_person, numbers)
    voted = _people(((route, person) for route, person, _ in votes), of_person, numbers)
    lines = _lines(routes, climbed, votes, of_person, [group.key for group in groups])
    _keep_back(lines, _Shown.of(routes, tried), _Shown.of(routes, voted))
    return Styles(since, until, list(groups) if len(groups) > 1 else [], lines)


@dataclass(frozen=True)
class _Shown:
    """The styles whose totals, and whose sums by group, may be published."""

    whole: set[Style]
    parts: set[Style]

    @classmethod
    def of(cls, routes: Mapping[Style, frozenset[str]], people: People) -> _Shown:
        together: dict[str, frozenset[int]] = {}
        for of in people.values():
            for route, who in of.items():
                together[route] = together.get(route, frozenset()) | who
        whole = safe_to_show(routes, {"": together})
        return cls(whole, whole & safe_to_show(routes, people))


def _keep_back(lines: list[StyleInsight], climbed: _Shown, liked: _Shown) -> None:
    """Remove from the lines what would expose fewer than five people."""
    for line in lines:
        style = Style(line.kind, line.value)
        if style not in climbed.whole:
            line.tried = line.topped = None
        if style not in liked.whole:
            line.votes = line.stars = None
        for cell in line.cells.values():
            if style not in climbed.parts:
                cell.tried = cell.topped = None
            if style not in liked.parts:
                cell.votes = cell.stars = None


def _read_tops(session: Session, gym: Gym, since: datetime, until: datetime) -> list[_Climbed]:
    is_top = Ascent.kind.in_(TOPS)
    rows = session.execute(
        select(
            cast(Ascent.route_id, String),
            cast(Ascent.person_id, String),
            func.max(case((is_top, 1), else_=0)),
            func.max(case((is_top, func.coalesce(Ascent.worth, 0)), else_=0)),
        )
        .where(what_counts(gym.id), Ascent.climbed_at >= since, Ascent.climbed_at < until)
        .group_by(Ascent.route_id, Ascent.person_id)
    )
    return [
        _Climbed(route, person, bool(topped), int(worth))
        for route, person, topped, worth in rows
        if route is not None
    ]


def _votes(
    session: Session, gym: Gym, since: datetime, until: datetime
) -> list[tuple[str, str, int]]:
    rows = session.execute(
        select(cast(Opinion.route_id, String), cast(Opinion.person_id, String), Opinion.stars)
        .join(Route, Route.id == Opinion.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(
            Wall.gym_id == gym.id,
            Opinion.stars.is_not(None),
            Opinion.changed_at >= since,
            Opinion.changed_at < until,
        )
    )
    return [(route, person, stars) for route, person, stars in rows if stars is not None]


def _route_styles(session: Session, gym: Gym) -> dict[Style, frozenset[str]]:
    """Return the styles of the gym's routes, from each route's latest scan."""
    rows = session.execute(
        select(
            cast(Route.id, String),
            Route.colour,
            Placement.steepness_deg,
            Placement.hold_types,
            Placement.holds,
        )
        .join(Wall, Wall.id == Route.wall_id)
        .join(Placement, Placement.route_id == Route.id)
        .join(Scan, Scan.id == Placement.scan_id)
        .where(Wall.gym_id == gym.id)
        .order_by(Scan.created_at)
    )
    last = {
        route: {
            "steepness": steepness_of(degrees),
            "hold": main_hold(types or {}),
            "colour": colour,
            "length": length_of(len(holds)),
        }
        for route, colour, degrees, types, holds in rows
    }
    found: dict[Style, set[str]] = defaultdict(set)
    for route, of in last.items():
        for kind, value in of.items():
            if value:
                found[Style(kind, value)].add(route)
    return {style: frozenset(found[style]) for style in sorted(found)}


def _groups_of_people(
    session: Session, gym: Gym, climbed: list[_Climbed], by: str
) -> dict[Group, list[str]]:
    """Return each person's group; a small one joins the next (the last: the one before)."""
    if by == "bands":
        sorted_in = _by_band(climbed)
    else:
        people = {one.person for one in climbed}
        here = select(Ascent.person_id).where(Ascent.gym_id == gym.id)
        categories = select(cast(Profile.person_id, String), Profile.category)
        category_of = dict(session.execute(categories.where(Profile.person_id.in_(here))).all())
        sorted_in = {name: [] for name in ("women", "men", "other", "unsaid")}
        for person in sorted(people):
            sorted_in[category_of.get(person) or "unsaid"].append(person)
    merged: list[tuple[list[str], list[str]]] = []
    for name, people_of in sorted_in.items():
        if not people_of:
            continue
        if merged and len(merged[-1][1]) < ENOUGH:
            merged[-1][0].append(name)
            merged[-1][1].extend(people_of)
        else:
            merged.append(([name], list(people_of)))
    if len(merged) > 1 and len(merged[-1][1]) < ENOUGH:
        names, people_of = merged.pop()
        merged[-1][0].extend(names)
        merged[-1][1].extend(people_of)
    return {Group(tuple(names), len(people_of)): people_of for names, people_of in merged}


def _by_band(climbed: list[_Climbed]) -> dict[str, list[str]]:
    """Return people by band. Band 0 is below `BANDS[0]`; people without a top are a group of their
    own."""
    grades = [{"label": label} for label in FONT]
    begins = [worth_of("font", grades, label) for label in BANDS]
    best: dict[str, int] = {}
    for one in climbed:
        best[one.person] = max(best.get(one.person, -1), one.worth if one.topped else -1)
    sorted_in: dict[str, list[str]] = {name: [] for name in (_NO_TOP, "0", "1", "2", "3")}
    for person, worth in sorted(best.items()):
        band = _NO_TOP if worth < 0 else str(sum(worth >= begin for begin in begins))
        sorted_in[band].append(person)
    return sorted_in


def _people(
    pairs: Iterable[tuple[str, str]], of_person: Mapping[str, str], numbers: Mapping[str, int]
) -> People:
    found: dict[str, dict[str, set[int]]] = {key: {} for key in sorted(set(of_person.values()))}
    for route, person in pairs:
        found[of_person[person]].setdefault(route, set()).add(numbers[person])
    return {
        key: {route: frozenset(people) for route, people in of.items()} for key, of in found.items()
    }


def _lines(
    routes: Mapping[Style, frozenset[str]],
    climbed: list[_Climbed],
    votes: list[tuple[str, str, int]],
    of_person: Mapping[str, str],
    groups: list[str],
) -> list[StyleInsight]:
    of_route: dict[str, list[Style]] = defaultdict(list)
    for style, these in routes.items():
        for route in these:
            of_route[route].append(style)
    lines = {
        style: StyleInsight(
            style.kind,
            style.value,
            len(these),
            0,
            0,
            0,
            None,
            {key: StyleCell(0, 0, 0, None) for key in groups} if len(groups) > 1 else {},
        )
        for style, these in routes.items()
    }
    for one in climbed:
        for style in of_route[one.route]:
            line = lines[style]
            for sums in (line, line.cells.get(of_person[one.person])):
                if sums is not None:
                    sums.tried = (sums.tried or 0) + 1
                    sums.topped = (sums.topped or 0) + one.topped
    samples: dict[Style, Sample] = {}
    given: dict[tuple[Style, str], int] = defaultdict(int)
    for route, person, stars in votes:
        for style in of_route[route]:
            line, key = lines[style], of_person[person]
            samples[style] = samples.get(style, NOTHING) + Sample(1, stars, stars**2)
            line.votes = (line.votes or 0) + 1
            given[style, key] += stars
            if key in line.cells:
                cell = line.cells[key]
                cell.votes = (cell.votes or 0) + 1
                cell.stars = round(given[style, key] / cell.votes, 2)
    for style, line in lines.items():
        alike = {s: sample for s, sample in samples.items() if s.kind == style.kind}
        mean = shrunk_means(alike).get(style)
        line.stars = None if mean is None else round(mean, 2)
    return [line for line in lines.values() if line.tried or line.votes]
