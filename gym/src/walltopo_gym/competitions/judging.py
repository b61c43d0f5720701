"""Validation of arriving score events: each is stored once, in one order, from authorised
people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import ClassVar, Final
from uuid import UUID

from sqlalchemy import func, literal, select
from sqlalchemy.orm import Session, aliased

from walltopo_gym.clock import now
from walltopo_gym.competitions.bodies import EventBody
from walltopo_gym.competitions.entering import entry_of
from walltopo_gym.competitions.history import struck_events
from walltopo_gym.competitions.judge_links import is_over
from walltopo_gym.competitions.ledger import (
    BOULDER_KINDS,
    JUDGED,
    LEAD_KINDS,
    SCORED,
    STRIKING,
    Kind,
)
from walltopo_gym.competitions.models import (
    Competition,
    Entry,
    LinkJudge,
    Problem,
    Round,
    ScoreEvent,
    Starter,
    Wave,
)
from walltopo_gym.competitions.scoring.rules import Scoring
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError, RequestError

_SAME: Final = (
    "entry_id",
    "problem_id",
    "kind",
    "n",
    "hold",
    "plus",
    "seconds",
    "target_id",
    "text",
    "device",
    "number",
)
_LONGEST_LATE: Final = timedelta(days=7)
# Events of one competitor on one problem: the competitor's own; those by all judges' links; and
# all events, when a judge with an account sends one.
MAX_OWN_EVENTS: Final = 300
MAX_EVENTS: Final = 1_000
# Events that strike each other in a row; a judge strikes the first one instead of the last.
MAX_CHAIN: Final = 20
# The IFSC allows 6 minutes; a gym may allow more.
MAX_CLIMB: Final = timedelta(hours=1)


@dataclass(frozen=True)
class Account:
    """An account as the sender of score events; `judges`: whether it may score everybody."""

    person: UUID
    judges: bool = False

    @property
    def columns(self) -> dict[str, UUID]:
        """Return the sender by the columns of an event."""
        return {"person_id": self.person}

    def sent(self, session: Session, kept: ScoreEvent) -> bool:
        """Return whether a stored event came from this account."""
        return kept.person_id == self.person


@dataclass(frozen=True)
class ByLink:
    """A judge by link as the sender of score events about the link's problem."""

    judge: LinkJudge
    problem: UUID
    judges: ClassVar[bool] = True

    @property
    def columns(self) -> dict[str, UUID]:
        """Return the sender by the columns of an event."""
        return {"link_judge_id": self.judge.id}

    def sent(self, session: Session, kept: ScoreEvent) -> bool:
        """Return whether a stored event came by this judge's link."""
        if kept.link_judge_id is None:
            return False
        return session.get_one(LinkJudge, kept.link_judge_id).link_id == self.judge.link_id


def store_event(
    session: Session, row: Competition, event: UUID, body: EventBody, sender: Account | ByLink
) -> tuple[ScoreEvent, bool]:
    """Store an event and return it and whether it is new; a stored one stays as it is.

    Parameters
    ----------
    row : locked, so that events are committed in the order of their numbers.

    Raises
    ------
    ConflictError : the id is another event's, scoring is closed, or no attempts are left.
    ForbiddenError : the sender may not send this event.
    RequestError, NotFoundError : the event is inconsistent, or refers to a missing object.
    """
    kept = session.get(ScoreEvent, event)
    if kept is not None:
        same = kept.competition_id == row.id and sender.sent(session, kept)
        if not same or any(getattr(kept, name) != getattr(body, name) for name in _SAME):
            raise ConflictError("id-taken", "id-another")
        return kept, False
    at = now()
    climbed_at = _true_time(body, at)
    entry = entry_of(session, row, body.entry_id)
    _check_sense(session, row, body)
    one = _check_problem(session, row, body, entry)
    _check_open(row)
    _check_number(session, body, sender)
    chain = _chain_of_targets(session, body.target_id) if body.kind in STRIKING else []
    if isinstance(sender, ByLink):
        _check_link(body, sender, chain)
        for touched in _rounds_touched(session, chain, one):
            _check_window(row, touched, max(climbed_at, sender.judge.created_at), at)
            _check_late_strike(session, row, touched, sender, chain, at)
    elif not sender.judges:
        _check_own(row, body, entry, sender.person, chain)
        if body.kind in STRIKING:  # an appeal changes no result, so it may come after a round
            _check_not_struck(session, body, sender.person, row.id, chain)
            for touched in _rounds_touched(session, chain, one):
                _check_window(row, touched, climbed_at, at)
                _check_wave(session, row, touched, entry, climbed_at, at)
    row.last_seq += 1
    kept = ScoreEvent(
        id=event,
        competition_id=row.id,
        seq=row.last_seq,
        **sender.columns,
        at=at,
        climbed_at=climbed_at,
        made_at=body.made_at,
        **{name: getattr(body, name) for name in _SAME},
    )
    session.add(kept)
    session.flush()
    return kept, True


def _true_time(body: EventBody, at: datetime) -> datetime:
    """Return the time of climbing by the server's clock: the event's age when it was sent,
    subtracted from its arrival. Impossible ages count as zero."""
    waited = body.sent_at - body.made_at
    return at - waited if timedelta(0) <= waited <= _LONGEST_LATE else at


def _check_open(row: Competition) -> None:
    if row.state != "running":
        raise ConflictError("cup-not-running", "cup-ask-runner")


def _check_sense(session: Session, row: Competition, body: EventBody) -> None:
    if body.kind in SCORED and (body.problem_id is None or body.n is None or body.n < 1):
        raise RequestError("event-needs-problem", kind=body.kind)
    _check_high_point(body)
    if body.kind == Kind.DECISION and body.n not in (0, 1):
        raise RequestError("event-decision")
    if body.kind == Kind.OUT and body.problem_id is not None:
        raise RequestError("event-out-of-all")
    if body.kind in (Kind.VOID, Kind.DECISION) and body.target_id is None:
        raise RequestError("event-needs-event", kind=body.kind)
    if body.target_id is None:
        return
    target = session.get(ScoreEvent, body.target_id)
    if target is None or target.competition_id != row.id:
        raise NotFoundError("not-there-event")
    if target.entry_id != body.entry_id:
        raise RequestError("event-other-competitor")
    if (body.kind == Kind.DECISION) != (target.kind == Kind.APPEAL) and body.kind != Kind.VOID:
        raise RequestError("event-appeals-only")


def _check_high_point(body: EventBody) -> None:
    """Check that a high point has a hold, and no other event has what belongs to it."""
    if body.kind == Kind.HIGH and body.hold is None:
        raise RequestError("event-needs-hold")
    if body.kind != Kind.HIGH and (body.hold is not None or body.plus):
        raise RequestError("event-hold-of-high")
    if body.kind not in LEAD_KINDS and body.seconds is not None:
        raise RequestError("event-time-of-high")
    if body.seconds is not None and body.seconds > MAX_CLIMB.total_seconds():
        raise RequestError("event-time-long", minutes=int(MAX_CLIMB.total_seconds()) // 60)


def _check_fits_rules(one: Round, problem: Problem, body: EventBody) -> None:
    """Check that a score fits the rules of its round and the holds of its route."""
    is_lead = Scoring.of(one.scoring).is_lead
    if body.kind not in (LEAD_KINDS if is_lead else BOULDER_KINDS):
        raise RequestError("event-of-lead" if is_lead else "event-of-boulder", round=one.name)
    if not is_lead and body.seconds is not None:
        raise RequestError("event-time-of-high")
    if problem.holds is not None and (body.hold or 0) > problem.holds:
        raise RequestError("event-hold-beyond", hold=body.hold, holds=problem.holds)
    if one.max_attempts is not None and (body.n or 0) > one.max_attempts:
        raise ConflictError("event-attempts", count=one.max_attempts, round=one.name)


def _check_problem(
    session: Session, row: Competition, body: EventBody, entry: Entry
) -> Round | None:
    """Return the round of the problem, in which this competitor must climb."""
    if body.problem_id is None:
        return None
    problem = session.get(Problem, body.problem_id)
    one = None if problem is None else session.get(Round, problem.round_id)
    if problem is None or one is None or one.competition_id != row.id:
        raise NotFoundError("not-there-problem")
    if problem.category_ids and str(entry.category_id) not in problem.category_ids:
        raise RequestError("cup-other-category")
    if body.kind not in SCORED:
        return one
    _check_fits_rules(one, problem, body)
    if one.begun_at is None:
        raise ConflictError("cup-round-not-begun", name=one.name)
    if one.quota is not None and session.get(Starter, (one.id, entry.id)) is None:
        raise ConflictError("cup-not-in-round", name=entry.name, round=one.name)
    if entry.withdrawn:
        raise ConflictError("cup-withdrawn", name=entry.name)
    return one


def _check_number(session: Session, body: EventBody, sender: Account | ByLink) -> None:
    """Refuse more events of a competitor on a problem than an honest day has.

    Raises
    ------
    ConflictError : there are too many; a judge with an account may still enter some.
    """
    here = ScoreEvent.entry_id == body.entry_id, ScoreEvent.problem_id == body.problem_id
    events = select(func.count()).select_from(ScoreEvent).where(*here)
    if isinstance(sender, ByLink):
        events = events.where(ScoreEvent.link_judge_id.is_not(None))
    elif not sender.judges:
        events = events.where(ScoreEvent.person_id == sender.person)
    is_judge = isinstance(sender, Account) and sender.judges
    if (session.scalar(events) or 0) >= (MAX_EVENTS if is_judge else MAX_OWN_EVENTS):
        raise ConflictError("event-too-many", "" if is_judge else "cup-ask-judge")


def _chain_of_targets(session: Session, event: UUID | None) -> Sequence[ScoreEvent]:
    """Return an event, its target, the target of that, and so on to the end.

    Raises
    ------
    ConflictError : there are too many.
    """
    if event is None:
        return []
    first = select(ScoreEvent.id, ScoreEvent.target_id, literal(1).label("place"))
    chain = first.where(ScoreEvent.id == event).cte("chain", recursive=True)
    following = select(ScoreEvent.id, ScoreEvent.target_id, chain.c.place + 1).join(
        chain, ScoreEvent.id == chain.c.target_id
    )
    chain = chain.union_all(following.where(chain.c.place <= MAX_CHAIN))
    rows = select(ScoreEvent).join(chain, chain.c.id == ScoreEvent.id).order_by(chain.c.place)
    found = session.scalars(rows).all()
    if len(found) > MAX_CHAIN:
        raise ConflictError("event-chain", "event-enter-anew")
    return found


def _check_link(body: EventBody, sender: ByLink, chain: Sequence[ScoreEvent]) -> None:
    """Check that an event by a judge's link is about the results of the link's problem alone.

    Parameters
    ----------
    chain : the event's target, the target of that, and so on.

    Raises
    ------
    ForbiddenError : it is not.
    """
    kinds = {body.kind, *(Kind(event.kind) for event in chain)}
    if not kinds <= SCORED | {Kind.VOID}:
        raise ForbiddenError("judge-link-scores", "cup-ask-judge")
    problems = {body.problem_id, *(event.problem_id for event in chain)}
    if problems != {sender.problem}:
        raise ForbiddenError("judge-link-problem", "judge-link-scan-other")


def _check_late_strike(
    session: Session,
    row: Competition,
    one: Round,
    sender: ByLink,
    chain: Sequence[ScoreEvent],
    at: datetime,
) -> None:
    """Refuse an event by a judge's link that touches another sender's result of an ended round.

    It strikes the result, or an event that strikes it.

    Raises
    ------
    ForbiddenError : it does so.
    """
    if is_over(one, row, at) and not all(sender.sent(session, event) for event in chain):
        raise ForbiddenError("judge-link-late", "cup-ask-judge", name=one.name)


def _check_own(
    row: Competition, body: EventBody, entry: Entry, person: UUID, chain: Sequence[ScoreEvent]
) -> None:
    """Check that the competition allows a competitor's own event.

    Parameters
    ----------
    chain : the event's target, the target of that, and so on.
    """
    if entry.person_id != person or body.kind in JUDGED:
        raise ForbiddenError("cup-judge-only")
    if body.kind not in STRIKING:
        return
    if not row.self_scoring:
        raise ForbiddenError("cup-judges-enter", "cup-ask-judge")
    if chain and (chain[0].person_id != person or chain[0].kind in JUDGED):
        raise ForbiddenError("cup-judge-entered", "cup-ask-judge-appeal")


def _check_not_struck(
    session: Session, body: EventBody, person: UUID, competition: UUID, chain: Sequence[ScoreEvent]
) -> None:
    """Refuse a competitor's own event that gives back what a judge struck or corrected.

    It scores on a problem where a judge's counting event strikes a result that the competitor
    entered; or it strikes an event that strikes such a result. The judge takes that event back
    first.

    Raises
    ------
    ForbiddenError : says that a judge struck the result.
    """
    problems = {body.problem_id} if body.kind in SCORED else set()
    problems |= {event.problem_id for event in chain[1:]}
    own = aliased(ScoreEvent)
    by_judges = (
        select(ScoreEvent.id)
        .join(own, own.id == ScoreEvent.target_id)
        .where(
            ScoreEvent.entry_id == body.entry_id,
            ScoreEvent.kind.in_(STRIKING),
            ScoreEvent.person_id.is_distinct_from(person),
            own.kind.in_(SCORED),
            own.person_id == person,
            own.problem_id.in_(problems - {None}),
        )
    )
    found = set(session.scalars(by_judges))
    if found and found - struck_events(session, competition, found):
        raise ForbiddenError("cup-judge-struck", "cup-ask-judge-appeal")


def _rounds_touched(
    session: Session, chain: Sequence[ScoreEvent], one: Round | None
) -> list[Round]:
    """Return the round of an event and the rounds in which it changes what counts.

    An event changes its target, what the target strikes, and so on to the end of that chain.

    Parameters
    ----------
    one : the round of the event's own problem.
    """
    problems = {event.problem_id for event in chain if event.problem_id is not None}
    of_problems = select(Problem.round_id).where(Problem.id.in_(problems))
    rounds = session.scalars(select(Round).where(Round.id.in_(of_problems)).order_by(Round.place))
    return [*rounds] if one is None else [one, *rounds]


def _check_window(row: Competition, one: Round, climbed_at: datetime, at: datetime) -> None:
    """Refuse an event outside the round's time, by a competitor or a judge's link.

    By a link, `climbed_at` is not before it was opened: one that is opened late enters nothing.

    Raises
    ------
    ConflictError : says whether the round has not begun or is over.
    """
    if one.state == "waiting" or (one.opens_at is not None and climbed_at < one.opens_at):
        raise ConflictError("cup-round-not-begun", name=one.name)
    end = one.closes_at
    has_ended = one.state == "ended" and (end is None or end > at)
    if has_ended or (end is not None and _is_after(row, end, climbed_at, at)):
        raise ConflictError("cup-round-over", "cup-tell-judge", name=one.name)


def _is_after(row: Competition, end: datetime, climbed_at: datetime, at: datetime) -> bool:
    """Return whether an event comes after an end; those climbed in time may arrive late."""
    return climbed_at > end or at > end + timedelta(minutes=row.late_minutes)


def _check_wave(
    session: Session, row: Competition, one: Round, entry: Entry, climbed_at: datetime, at: datetime
) -> None:
    """Refuse a competitor's own event outside their wave; those climbed in time may arrive late.

    Raises
    ------
    ConflictError : says whether they have no wave, or theirs has not begun or is over.
    """
    wave = None if entry.wave_id is None else session.get_one(Wave, entry.wave_id)
    if wave is None or wave.round_id != one.id:
        if session.scalar(select(Wave.id).where(Wave.round_id == one.id).limit(1)) is not None:
            raise ConflictError("cup-no-wave", "cup-ask-desk")
        return
    if climbed_at < wave.starts_at:
        raise ConflictError("cup-wave-not-begun", name=wave.name)
    if _is_after(row, wave.ends_at, climbed_at, at):
        raise ConflictError("cup-wave-over", "cup-tell-judge", name=wave.name)
