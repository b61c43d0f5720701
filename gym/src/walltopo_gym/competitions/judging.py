"""Score events as they arrive: once, in one order, from who may say them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.clock import now
from walltopo_gym.competitions.entering import entry_of
from walltopo_gym.competitions.ledger import JUDGED, SCORED, Kind
from walltopo_gym.competitions.models import Competition, Entry, Problem, Round, ScoreEvent, Starter
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError

_SAME: Final = ("entry_id", "problem_id", "kind", "n", "target_id", "text", "device", "number")
_LONGEST_LATE: Final = timedelta(days=7)


@dataclass(frozen=True)
class Said:
    """What a device sends; `made_at`, `sent_at` by its own clock."""

    entry_id: UUID
    problem_id: UUID | None
    kind: Kind
    n: int | None
    target_id: UUID | None
    text: str
    device: str
    number: int
    made_at: datetime
    sent_at: datetime


def keep_event(
    session: Session, row: Competition, event: UUID, said: Said, person: UUID, *, judges: bool
) -> tuple[ScoreEvent, bool]:
    """Keep an event, and whether it is new; one that is here already stays as it is.

    Parameters
    ----------
    row : locked, so that events are committed in the order of their numbers.
    judges : whether the person may speak for everybody.

    Raises
    ------
    ConflictError : the id is another event's, or nothing is taken any more.
    ForbiddenError : it is not theirs to say.
    InputError, NotFoundError : it makes no sense, or is about nothing that is here.
    """
    kept = session.get(ScoreEvent, event)
    if kept is not None:
        same = kept.competition_id == row.id and kept.person_id == person
        if not same or any(getattr(kept, name) != getattr(said, name) for name in _SAME):
            raise ConflictError("this id is taken", "Make another one.")
        return kept, False
    at = now()
    climbed_at = _true_time(said, at)
    entry = entry_of(session, row, said.entry_id)
    _check_sense(session, row, said)
    one = _check_problem(session, row, said, entry)
    _check_open(row)
    if not judges:
        _check_own(session, row, said, entry, one, person, climbed_at, at)
    row.last_seq += 1
    kept = ScoreEvent(
        id=event, competition_id=row.id, seq=row.last_seq, person_id=person, at=at,
        climbed_at=climbed_at, made_at=said.made_at,
        **{name: getattr(said, name) for name in _SAME},
    )  # fmt: skip
    session.add(kept)
    session.flush()
    return kept, True


def _true_time(said: Said, at: datetime) -> datetime:
    """When it happened by the server's clock: as long before it arrived as the device says that it
    was made before it was sent. What cannot be counts as now."""
    waited = said.sent_at - said.made_at
    return at - waited if timedelta(0) <= waited <= _LONGEST_LATE else at


def _check_open(row: Competition) -> None:
    if row.state != "running":
        raise ConflictError("this competition is not running", "Ask whoever runs it.")


def _check_sense(session: Session, row: Competition, said: Said) -> None:
    if said.kind in SCORED and (said.problem_id is None or said.n is None or said.n < 1):
        raise InputError(f"{said.kind} needs a problem and the number of the try")
    if said.kind == Kind.DECISION and said.n not in (0, 1):
        raise InputError("a decision is 1 (upheld) or 0 (rejected)")
    if said.kind == Kind.OUT and said.problem_id is not None:
        raise InputError("one is out of the whole competition, not of a problem")
    if said.kind in (Kind.VOID, Kind.DECISION) and said.target_id is None:
        raise InputError(f"{said.kind} needs the event that it is about")
    if said.target_id is None:
        return
    target = session.get(ScoreEvent, said.target_id)
    if target is None or target.competition_id != row.id:
        raise NotFoundError("no such score event")
    if target.entry_id != said.entry_id:
        raise InputError("the event that it is about is another competitor's")
    if (said.kind == Kind.DECISION) != (target.kind == Kind.APPEAL) and said.kind != Kind.VOID:
        raise InputError("an appeal is decided, and nothing else is")


def _check_problem(session: Session, row: Competition, said: Said, entry: Entry) -> Round | None:
    """The round of the problem, in which this competitor climbs."""
    if said.problem_id is None:
        return None
    problem = session.get(Problem, said.problem_id)
    one = None if problem is None else session.get(Round, problem.round_id)
    if problem is None or one is None or one.competition_id != row.id:
        raise NotFoundError("no such problem")
    if problem.category_ids and str(entry.category_id) not in problem.category_ids:
        raise InputError("this problem is not of the competitor's category")
    if said.kind not in SCORED:
        return one
    if one.begun_at is None:
        raise ConflictError(f"the round {one.name!r} has not begun")
    if one.quota is not None and session.get(Starter, (one.id, entry.id)) is None:
        raise ConflictError(f"{entry.name} is not in the round {one.name!r}")
    if entry.withdrawn:
        raise ConflictError(f"{entry.name} has withdrawn")
    return one


def _check_own(
    session: Session, row: Competition, said: Said, entry: Entry, one: Round | None, person: UUID,
    climbed_at: datetime, at: datetime,
) -> None:  # fmt: skip
    """A competitor's own results, in time, where the competition says so; and an appeal."""
    if entry.person_id != person or said.kind in JUDGED:
        raise ForbiddenError("only a judge of this gym may do this")
    if said.kind == Kind.APPEAL:
        return
    if not row.self_scoring:
        raise ForbiddenError("results are entered by judges here", "Ask a judge.")
    if said.target_id is not None:
        target = session.get_one(ScoreEvent, said.target_id)
        if target.person_id != person or target.kind in JUDGED:
            raise ForbiddenError("a judge entered this", "Ask a judge, or appeal.")
    for touched in _rounds_touched(session, said, one):
        _check_window(row, touched, climbed_at, at)


def _rounds_touched(session: Session, said: Said, one: Round | None) -> list[Round]:
    """Return the round of an event and the rounds in which it changes what counts.

    An event changes its target, what the target strikes, and so on to the end of that chain.

    Parameters
    ----------
    one : the round of the event's own problem.
    """
    problems: set[UUID] = set()
    target = said.target_id
    while target is not None:
        event = session.get_one(ScoreEvent, target)
        if event.problem_id is not None:
            problems.add(event.problem_id)
        target = event.target_id
    of_problems = select(Problem.round_id).where(Problem.id.in_(problems))
    rounds = session.scalars(select(Round).where(Round.id.in_(of_problems)).order_by(Round.place))
    return [*rounds] if one is None else [one, *rounds]


def _check_window(row: Competition, one: Round, climbed_at: datetime, at: datetime) -> None:
    """Refuse a competitor's own event outside the round's time.

    Raises
    ------
    ConflictError : says whether the round has not begun or is over.
    """
    if one.state == "waiting" or (one.opens_at is not None and climbed_at < one.opens_at):
        raise ConflictError(f"the round {one.name!r} has not begun")
    if one.closes_at is not None:
        late = one.closes_at + timedelta(minutes=row.late_minutes)
        if climbed_at > one.closes_at or at > late:
            raise ConflictError(f"the round {one.name!r} is over", "Tell a judge.")
    elif one.state == "ended":
        raise ConflictError(f"the round {one.name!r} is over", "Tell a judge.")
