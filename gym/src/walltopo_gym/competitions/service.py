"""Create competitions, change their sheet, open, start and end them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final
from uuid import UUID, uuid4

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.competitions.bodies import (
    CategoryBody,
    ProblemBody,
    RoundBody,
    State,
    WaveBody,
)
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    Problem,
    Round,
    ScoreEvent,
    Wave,
)
from walltopo_gym.competitions.order import check_before, draw_order, forget_drawn, is_drawn
from walltopo_gym.competitions.scoring.rules import Rules, Scoring
from walltopo_gym.competitions.sheet import Format
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.events import CompetitionMoved, publish_event
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.models import Wall

_ONE_ROUND: Final = (Format.FESTIVAL, Format.NIGHT)


def locked_competition(session: Session, gym: UUID, competition: UUID) -> Competition:
    """Return a competition of this gym, locked against changes and scores.

    Raises
    ------
    NotFoundError : this gym has no such competition.
    """
    row = session.get(Competition, competition, with_for_update=True, populate_existing=True)
    if row is None or row.gym_id != gym:
        raise NotFoundError("not-there-competition")
    return row


def change_sheet(
    session: Session,
    row: Competition,
    categories: Sequence[CategoryBody],
    rounds: Sequence[RoundBody],
) -> None:
    """Replace the categories and rounds of a competition.

    Raises
    ------
    RequestError : they do not fit the format, or refer to missing objects.
    ConflictError : a removed one has entries or scores.
    """
    _check_form(Format(row.format), categories, rounds)
    session.flush()
    known = _prune_rows(session, Category, Category.competition_id == row.id, categories)
    for place, wanted in enumerate(categories):
        category = _row_of(session, known, wanted.id, Category, competition_id=row.id)
        category.place, category.name, category.gender = place, wanted.name, wanted.gender
        category.born_from, category.born_to = wanted.born_from, wanted.born_to
    session.flush()
    ids = set(session.scalars(select(Category.id).where(Category.competition_id == row.id)))
    _change_rounds(session, row, rounds, ids)
    row.revision += 1
    session.flush()


def _check_form(
    form: Format, categories: Sequence[CategoryBody], rounds: Sequence[RoundBody]
) -> None:
    if not categories or not rounds:
        raise RequestError("cup-needs-both")
    if form in _ONE_ROUND and len(rounds) > 1:
        raise RequestError("cup-one-round", "cup-make-rounds")
    if form != Format.ROUNDS and any(wanted.quota is not None for wanted in rounds):
        raise RequestError("cup-quota-rounds")
    if rounds[0].quota is not None:
        raise RequestError("cup-quota-first")
    if form == Format.LEAGUE and not all(Scoring.of(w.scoring.numbers).has_points for w in rounds):
        raise RequestError("cup-league-points")
    later = rounds if form == Format.LEAGUE else rounds[1:]
    if any(wanted.waves for wanted in later):
        raise RequestError("cup-waves-first")
    names = [wanted.name for wanted in categories]
    if len(set(names)) < len(names):
        raise RequestError("cup-category-twice")


def _change_rounds(
    session: Session, row: Competition, rounds: Sequence[RoundBody], categories: set[UUID]
) -> None:
    known = _prune_rows(session, Round, Round.competition_id == row.id, rounds)
    for place, wanted in enumerate(rounds):
        one = _row_of(session, known, wanted.id, Round, competition_id=row.id)
        one.place, one.name, one.kind = place, wanted.name, wanted.kind
        one.scoring, one.quota = wanted.scoring.numbers, wanted.quota
        one.opens_at, one.closes_at = wanted.opens_at, wanted.closes_at
        one.max_attempts = wanted.max_attempts
        one.isolation_minutes = wanted.isolation_minutes
        one.rotation_seconds = wanted.rotation_seconds
        session.flush()
        _change_waves(session, one, wanted.waves)
        _change_problems(session, row, one, wanted.all_problems, categories)


def _change_waves(session: Session, one: Round, all_wanted: Sequence[WaveBody]) -> None:
    known = _prune_rows(session, Wave, Wave.round_id == one.id, all_wanted)
    for place, wanted in enumerate(all_wanted):
        _check_wave(one, wanted)
        wave = _row_of(session, known, wanted.id, Wave, round_id=one.id)
        wave.place, wave.name, wave.places = place, wanted.name, wanted.places
        wave.starts_at, wave.ends_at = wanted.starts_at, wanted.ends_at
    session.flush()


def _check_wave(one: Round, wanted: WaveBody) -> None:
    """Check the times of a wave; a round that has begun may have ended before its last wave.

    Raises
    ------
    RequestError : it ends before it starts, or lies outside the planned time of its round.
    """
    if wanted.ends_at <= wanted.starts_at:
        raise RequestError("cup-wave-ends-before", name=wanted.name)
    opens_at, closes_at = one.opens_at or wanted.starts_at, one.closes_at or wanted.ends_at
    if one.begun_at is None and not opens_at <= wanted.starts_at < wanted.ends_at <= closes_at:
        raise RequestError("cup-wave-outside", "cup-wave-times", name=wanted.name)


def _change_problems(
    session: Session,
    row: Competition,
    one: Round,
    all_wanted: Sequence[ProblemBody],
    categories: set[UUID],
) -> None:
    known = _prune_rows(session, Problem, Problem.round_id == one.id, all_wanted)
    for place, wanted in enumerate(all_wanted):
        if not categories.issuperset(wanted.category_ids):
            raise RequestError("sheet-no-category")
        problem = known.get(wanted.id) if wanted.id else None
        if problem is None or wanted.route_id is None or wanted.route_id != problem.route_id:
            words = _problem_fields(session, row.gym_id, wanted)
        else:
            words = {}
        if problem is None:
            problem = Problem(id=wanted.id or uuid4(), round_id=one.id)
            session.add(problem)
        for name, value in words.items():
            setattr(problem, name, value)
        problem.place, problem.label, problem.route_id = place, wanted.label, wanted.route_id
        problem.points = wanted.points and wanted.points.model_dump()
        problem.category_ids = [str(category) for category in wanted.category_ids]
        problem.holds = wanted.holds
    session.flush()
    if one.begun_at is not None:
        _check_holds(session, one)


def _check_holds(session: Session, one: Round) -> None:
    """Check that each route has a number of holds where a top is worth that number.

    Raises
    ------
    ConflictError : a route has none.
    """
    if Scoring.of(one.scoring).rules != Rules.LEAD_POINTS:
        return
    missing = select(Problem.id).where(Problem.round_id == one.id, Problem.holds.is_(None))
    if session.scalar(missing.limit(1)) is not None:
        raise ConflictError("cup-holds-missing", "cup-holds-edit", name=one.name)


def _problem_fields(session: Session, gym: UUID, wanted: ProblemBody) -> dict[str, str]:
    """Return a problem's fields, copied from its route as of today, so that they outlive it."""
    if wanted.route_id is None:
        return wanted.words
    found = select(Route, Wall.name).join(Wall, Wall.id == Route.wall_id)
    there = session.execute(found.where(Route.id == wanted.route_id, Wall.gym_id == gym)).first()
    if there is None:
        raise NotFoundError("not-there-route")
    route, wall = there
    return {"name": route.name, "colour": route.colour, "grade": route.grade, "wall": wall}


def _prune_rows(
    session: Session, kind: Any, here: Any, all_wanted: Iterable[Any]
) -> dict[UUID, Any]:
    """Return the rows that stay, by id; delete the others unless they are in use."""
    rows = {row.id: row for row in session.scalars(select(kind).where(here))}
    given = [wanted.id for wanted in all_wanted if wanted.id is not None]
    if len(set(given)) < len(given):
        raise RequestError("sheet-twice")
    taken = set(given) - rows.keys()
    if taken and session.scalar(select(kind.id).where(kind.id.in_(taken))) is not None:
        raise ConflictError("id-taken", "id-another")
    for gone in rows.keys() - set(given):
        _check_unused(session, kind, gone)
        session.delete(rows[gone])
    return rows


def _row_of(
    session: Session, known: Mapping[UUID, Any], wanted: UUID | None, kind: Any, **parent: UUID
) -> Any:
    """Return the known row of an id, or a new one of this parent."""
    row = known.get(wanted) if wanted else None
    if row is None:
        row = kind(id=wanted or uuid4(), **parent)
        session.add(row)
    return row


def _check_unused(session: Session, kind: Any, gone: UUID) -> None:
    if kind is Category:
        used = select(func.count()).where(Entry.category_id == gone)
    elif kind is Wave:
        used = select(func.count()).where(Entry.wave_id == gone, Entry.withdrawn.is_(False))
    else:
        scored = select(func.count()).select_from(ScoreEvent)
        scored = scored.join(Problem, Problem.id == ScoreEvent.problem_id)
        used = scored.where((Problem.round_id if kind is Round else Problem.id) == gone)
    if kind is Round:
        for wave in session.scalars(select(Wave.id).where(Wave.round_id == gone)):
            _check_unused(session, Wave, wave)
    if session.scalar(used):
        raise ConflictError("cup-used", "cup-used-move")


def round_of(session: Session, row: Competition, one: UUID) -> Round:
    """Return a round of this competition.

    Raises
    ------
    NotFoundError : this competition has no such round.
    """
    found = session.get(Round, one)
    if found is None or found.competition_id != row.id:
        raise NotFoundError("not-there-round")
    return found


def move_competition(session: Session, row: Competition, state: State) -> None:
    """Change the state. Running begins the first round; ending ends all rounds.

    Raises
    ------
    ConflictError : back to a draft after a score.
    """
    if state == "draft" and row.last_seq:
        raise ConflictError("cup-scored", "cup-end-instead")
    has_moved = row.state != state
    row.state = state
    row.revision += 1
    rounds = _rounds(session, row)
    if state == "running" and all(one.state == "waiting" for one in rounds):
        _begin_round(session, row, rounds[0])
    if state == "ended":
        for one in rounds:
            one.state = "ended" if one.begun_at is not None else one.state
    session.flush()
    if has_moved and state in ("open", "running", "ended"):
        publish_event(session, CompetitionMoved(row.gym_id, row.id, state))


def move_round(session: Session, row: Competition, one: Round, state: str) -> None:
    """Begin, end or reopen a round, or make it wait again.

    A round with a quota draws its starters when it begins for the first time, unless that was done.

    Raises
    ------
    ConflictError : the competition does not run, or the round before has not ended.
    """
    if row.state != "running":
        raise ConflictError("cup-not-running", "cup-start-first")
    row.revision += 1
    if state == "running":
        # Reopened it ends when somebody says so.
        if one.closes_at is not None and one.closes_at <= now():
            one.closes_at = None
        _begin_round(session, row, one)
        forget_drawn(session, row, one)
        return
    one.state = state
    # Attempts that are still on their way count if they were climbed before this moment.
    if state == "ended" and (one.closes_at is None or one.closes_at > now()):
        one.closes_at = now()
    session.flush()


def set_board_frozen(session: Session, row: Competition, frozen: bool) -> None:
    """Freeze the public board, or unfreeze it."""
    if frozen != (row.frozen_at is not None):
        row.frozen_at = now() if frozen else None
        row.revision += 1
        session.flush()


def _begin_round(session: Session, row: Competition, one: Round) -> None:
    check_before(session, row, one)
    _check_holds(session, one)
    if one.quota is not None and one.begun_at is None and not is_drawn(session, one):
        draw_order(session, row, one)
    one.state, one.begun_at = "running", one.begun_at or now()
    session.flush()


def _rounds(session: Session, row: Competition) -> list[Round]:
    of = select(Round).where(Round.competition_id == row.id).order_by(Round.place)
    return list(session.scalars(of))
