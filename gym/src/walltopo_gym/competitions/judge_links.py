"""Links that let people without an account judge one problem while its round lasts.

The secret of a link is in the fragment of its address. A browser exchanges it, with the judge's
name, for a secret of its own in a cookie; both are stored as hashes. The cookie reads the start
list of the round and writes scores of the problem, until the link is revoked or the round ends.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.limits import count_judge_name
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now
from walltopo_gym.competitions.models import Competition, JudgeLink, LinkJudge, Problem, Round
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError, SignInNeededError
from walltopo_gym.gyms.members import role_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role

# Links of one problem that are not revoked.
MAX_LINKS: Final = 20
# Browsers, or names in one browser, that opened one link.
MAX_JUDGES: Final = 100


@dataclass(frozen=True)
class JudgeAccess:
    """A judge by link, and what the link is for."""

    judge: LinkJudge
    link: JudgeLink
    problem: Problem
    round: Round
    competition: Competition
    gym: Gym


def cookie_name(link: UUID) -> str:
    """Return the name of a link's cookie; each has its own, so that one phone judges several."""
    return f"__Host-walltopo-judge-{link.hex}"


def make_link(
    session: Session, one: Round, problem: Problem, person: UUID
) -> tuple[JudgeLink, str]:
    """Create a link to judge a problem; return it and its secret.

    Raises
    ------
    ConflictError : the round is over, or the problem has `MAX_LINKS` links.
    """
    competition = session.get_one(Competition, one.competition_id)
    if is_over(one, competition, now()):
        raise ConflictError("cup-round-over", name=one.name)
    current = select(func.count()).where(
        JudgeLink.problem_id == problem.id, JudgeLink.revoked_at.is_(None)
    )
    if (session.scalar(current) or 0) >= MAX_LINKS:
        label = label_of(session, problem)
        raise ConflictError("judge-links-many", "judge-links-revoke", problem=label, most=MAX_LINKS)
    secret, kept = new_secret()
    link = JudgeLink(problem_id=problem.id, token_hash=kept, person_id=person)
    session.add(link)
    session.flush()
    return link, secret


def links_of(session: Session, row: Competition) -> list[JudgeLink]:
    """Return the links of a competition by round and problem, the latest first."""
    rows = (
        select(JudgeLink)
        .join(Problem, Problem.id == JudgeLink.problem_id)
        .join(Round, Round.id == Problem.round_id)
        .where(Round.competition_id == row.id)
        .order_by(Round.place, Problem.place, JudgeLink.created_at.desc(), JudgeLink.id)
    )
    return list(session.scalars(rows))


def revoke_link(session: Session, link: JudgeLink) -> bool:
    """Revoke a link; return whether it was not revoked before."""
    if link.revoked_at is not None:
        return False
    link.revoked_at = now()
    session.flush()
    return True


def judges_of(session: Session, links: Collection[UUID]) -> list[LinkJudge]:
    """Return the judges who opened these links, the last active first."""
    rows = select(LinkJudge).where(LinkJudge.link_id.in_(links))
    return list(session.scalars(rows.order_by(LinkJudge.used_at.desc(), LinkJudge.id)))


def link_of(session: Session, row: Competition, link: UUID) -> JudgeLink:
    """Return a link of this competition.

    Raises
    ------
    NotFoundError : this competition has no such link.
    """
    found = session.get(JudgeLink, link)
    if found is None or _place_of(session, found)[2].id != row.id:
        raise NotFoundError("not-there-judge-link")
    return found


def link_with(session: Session, secret: str) -> JudgeLink | None:
    """Return the link of this secret; None if there is none."""
    return session.scalar(select(JudgeLink).where(JudgeLink.token_hash == hash_of(secret)))


def open_link(
    session: Session, secret: str, name: str, network: str, link_cookie: Any
) -> tuple[JudgeAccess, str, bool]:
    """Open a link in a browser; return the access, the secret for the browser's cookie, and whether
    the judge is new.

    Parameters
    ----------
    name : of the judge, as they typed it. network : of the browser.
    link_cookie : returns the cookie that the browser has for a link, by the link's id; the same
        judge in the same browser stays the same.

    Raises
    ------
    NotFoundError, ForbiddenError : no such link; it is revoked, or its round is over.
    ConflictError : `MAX_JUDGES` opened it.
    """
    link = link_with(session, secret)
    if link is None:
        raise NotFoundError("judge-link-unknown", "judge-link-ask-new")
    earlier = link_cookie(link.id)
    judge = _judge_with(session, link, earlier)
    is_new = judge is None or judge.name != name
    if judge is None or is_new:
        count_judge_name(session, link.id, network)
        _check_judges(session, link)
        earlier, kept = new_secret()
        judge = LinkJudge(link_id=link.id, name=name, token_hash=kept)
        session.add(judge)
    judge.used_at = now()
    session.flush()
    access = _judge_access(session, link, judge)
    check_open(access)
    return access, earlier, is_new


def judge_in(session: Session, link: UUID, cookie: str) -> JudgeAccess:
    """Return the access of a browser by its cookie for a link.

    Raises
    ------
    SignInNeededError : the browser has not opened this link.
    ForbiddenError : the link is revoked, or its maker is no setter of the gym any more.
    """
    found = session.get(JudgeLink, link, populate_existing=True)
    judge = None if found is None else _judge_with(session, found, cookie)
    if found is None or judge is None:
        raise SignInNeededError("judge-link-not-open", "judge-link-scan")
    return _judge_access(session, found, judge)


def check_open(access: JudgeAccess) -> None:
    """Check that the round of a link is not over.

    Raises
    ------
    ForbiddenError : it is.
    """
    if is_over(access.round, access.competition, now()):
        raise ForbiddenError("judge-link-over", "cup-tell-judge", name=access.round.name)


def link_names(
    session: Session, judges: Collection[UUID | None]
) -> dict[UUID | None, dict[str, str]]:
    """Return {by_name, by_link} of judges by link: their name, and the label of the problem."""
    if not judges:
        return {}
    rows = (
        select(LinkJudge.id, LinkJudge.name, Problem)
        .join(JudgeLink, JudgeLink.id == LinkJudge.link_id)
        .join(Problem, Problem.id == JudgeLink.problem_id)
        .where(LinkJudge.id.in_(judges))
    )
    return {
        judge: {"by_name": name, "by_link": label_of(session, problem)}
        for judge, name, problem in session.execute(rows)
    }


def label_of(session: Session, problem: Problem) -> str:
    """Return a problem's label, or else its number in the round."""
    if problem.label:
        return problem.label
    before = select(func.count()).where(
        Problem.round_id == problem.round_id, Problem.place < problem.place
    )
    return str((session.scalar(before) or 0) + 1)


def is_over(one: Round, competition: Competition, at: datetime) -> bool:
    """Return whether a round is over; that of an ended competition is, even if it never began."""
    has_ended = "ended" in (one.state, competition.state)
    return has_ended or (one.closes_at is not None and one.closes_at <= at)


def _check_judges(session: Session, link: JudgeLink) -> None:
    take_turn(session, f"judge link {link.id}")
    judges = select(func.count()).where(LinkJudge.link_id == link.id)
    if (session.scalar(judges) or 0) >= MAX_JUDGES:
        raise ConflictError("judge-link-many", "judge-link-ask-new", most=MAX_JUDGES)


def _judge_with(session: Session, link: JudgeLink, cookie: str) -> LinkJudge | None:
    held = LinkJudge.token_hash == hash_of(cookie)
    return session.scalar(select(LinkJudge).where(LinkJudge.link_id == link.id, held))


def _judge_access(session: Session, link: JudgeLink, judge: LinkJudge) -> JudgeAccess:
    problem, one, competition, gym = _place_of(session, link)
    if not gym.has("competitions"):
        raise NotFoundError("not-there-feature")
    if link.revoked_at is not None:
        raise ForbiddenError("judge-link-revoked", "judge-link-ask-new")
    if not role_of(session, gym.id, link.person_id).covers(Role.SETTER):
        raise ForbiddenError("judge-link-maker", "judge-link-ask-new")
    return JudgeAccess(judge, link, problem, one, competition, gym)


def _place_of(session: Session, link: JudgeLink) -> tuple[Problem, Round, Competition, Gym]:
    problem = session.get_one(Problem, link.problem_id)
    one = session.get_one(Round, problem.round_id)
    competition = session.get_one(Competition, one.competition_id)
    return problem, one, competition, session.get_one(Gym, competition.gym_id)
