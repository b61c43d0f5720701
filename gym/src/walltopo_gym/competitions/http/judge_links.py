"""Endpoints of judges' links: setters create and revoke them, and judges use them."""

from __future__ import annotations

from collections import defaultdict
from datetime import datetime
from typing import Annotated, Any, Final
from uuid import UUID

from fastapi import APIRouter, Depends, Request, Response
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import BrowserMay, Rule
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.limits import count_document, count_wrong_judge_link
from walltopo_gym.accounts.people import names_by_id
from walltopo_gym.api.documents import DocumentTurn, document_response
from walltopo_gym.api.fields import Body, Name, Secret
from walltopo_gym.api.services import Db, ServicesOf, network_of, rule_session
from walltopo_gym.clock import now
from walltopo_gym.competitions.bodies import (
    EventBody,
    MarkFields,
    ProblemOut,
    RoundState,
    ScoringBody,
)
from walltopo_gym.competitions.http.competitions import (
    StarterOut,
    competition_of,
    log_competition,
    running_order,
)
from walltopo_gym.competitions.http.scoring import (
    EventOut,
    PadEvent,
    ProblemMark,
    ResultsPaper,
    events_out,
    problem_marks,
)
from walltopo_gym.competitions.judge_links import (
    JudgeAccess,
    check_open,
    cookie_name,
    judge_in,
    judges_of,
    label_of,
    link_of,
    link_with,
    links_of,
    make_link,
    open_link,
    revoke_link,
)
from walltopo_gym.competitions.judge_sheet import JudgeCode, SheetSize, judge_sheet
from walltopo_gym.competitions.judging import ByLink, store_event
from walltopo_gym.competitions.models import Competition, JudgeLink, Problem, Round
from walltopo_gym.competitions.order import starters
from walltopo_gym.competitions.scoring.rules import Scoring
from walltopo_gym.competitions.service import locked_competition, round_of
from walltopo_gym.competitions.sheet import Format
from walltopo_gym.errors import ForbiddenError, NotFoundError
from walltopo_gym.gyms.access import Access, SetterMay
from walltopo_gym.languages import Language
from walltopo_gym.words import Words, words_in

router = APIRouter(tags=["competitions"])

# Longer than the latest results of a round may wait; a judge can scan the code again.
_COOKIE_S: Final = 7 * 86400


class LinkJudgeOut(BaseModel):
    """A judge who opened a link, by the name that they typed; `used_at`: when they opened it or
    sent a score last."""

    name: str
    opened_at: datetime
    used_at: datetime


class JudgeLinkOut(BaseModel):
    """A judge's link of a problem; `label`: the problem's; `made_by`: the name of who made it."""

    id: UUID
    problem_id: UUID
    round_id: UUID
    label: str
    made_at: datetime
    made_by: str
    revoked_at: datetime | None
    judges: list[LinkJudgeOut]


class NewJudgeLink(BaseModel):
    """A new judge's link; its address is shown once."""

    id: UUID
    link: str


class OpenBody(Body):
    """The secret of a judge's link, and the judge's name."""

    secret: Secret
    name: Name


class OpenedLink(BaseModel):
    """An opened link; this browser has a cookie for it now."""

    id: UUID


class PadEntry(BaseModel):
    """A competitor on a judge's pad."""

    id: UUID
    category_id: UUID
    bib: int
    name: str


class PadMark(MarkFields):
    """A competitor's mark on the problem, and its events."""

    entry_id: UUID
    events: list[PadEvent]


class JudgePad(BaseModel):
    """All that a judge by link sees: their name, the problem and its round, the start list, and the
    marks on the problem. `starters`: the running order, empty without one."""

    link_id: UUID
    judge: str
    competition_id: UUID
    competition: str
    gym: str
    round_id: UUID
    round: str
    kind: str
    state: RoundState
    scoring: ScoringBody
    max_attempts: int | None
    problem: ProblemOut
    entries: list[PadEntry]
    starters: list[StarterOut]
    marks: list[PadMark]


def _link_rule(link: UUID, request: Request, services: ServicesOf) -> JudgeAccess:
    if "authorization" in request.headers:
        raise ForbiddenError("token-never", "judge-link-scan")
    with rule_session(request, services) as session:
        return judge_in(session, link, request.cookies.get(cookie_name(link), ""))


_link_rule.rule = Rule("judge-link", None)  # type: ignore[attr-defined]
JudgeByLink = Annotated[JudgeAccess, Depends(_link_rule)]


@router.get("/gyms/{gym}/competitions/{competition}/judge-links")
def list_judge_links(competition: UUID, session: Db, access: SetterMay) -> list[JudgeLinkOut]:
    """Return the judges' links of a competition and who uses them, by round and problem."""
    row = competition_of(session, access, competition)
    links = links_of(session, row)
    judges = defaultdict[UUID, list[LinkJudgeOut]](list)
    for judge in judges_of(session, [link.id for link in links]):
        facts = LinkJudgeOut(name=judge.name, opened_at=judge.created_at, used_at=judge.used_at)
        judges[judge.link_id].append(facts)
    names = names_by_id(session, (link.person_id for link in links))
    ids = {link.problem_id for link in links}
    problems = {problem: session.get_one(Problem, problem) for problem in ids}
    labels = {problem: label_of(session, found) for problem, found in problems.items()}
    return [
        JudgeLinkOut(
            id=link.id,
            problem_id=link.problem_id,
            round_id=problems[link.problem_id].round_id,
            label=labels[link.problem_id],
            made_at=link.created_at,
            made_by=names.get(link.person_id, ""),
            revoked_at=link.revoked_at,
            judges=judges[link.id],
        )
        for link in links
    ]


@router.post(
    "/gyms/{gym}/competitions/{competition}/problems/{problem}/judge-links", status_code=201
)
def make_judge_link(
    competition: UUID, problem: UUID, session: Db, services: ServicesOf, access: SetterMay
) -> NewJudgeLink:
    """Create a link to judge a problem until its round ends."""
    row = locked_competition(session, access.gym.id, competition)
    found = session.get(Problem, problem)
    if found is None:
        raise NotFoundError("not-there-problem")
    one = round_of(session, row, found.round_id)
    link, secret = make_link(session, one, found, access.actor.known)
    _log_judge_link(session, access, "judge-link.create", row, one, found)
    return NewJudgeLink(id=link.id, link=_link_address(services, secret))


@router.post(
    "/gyms/{gym}/competitions/{competition}/rounds/{one}/judge-sheet", response_class=ResultsPaper
)
def make_judge_sheet(
    competition: UUID,
    one: UUID,
    request: Request,
    _: DocumentTurn,
    services: ServicesOf,
    access: SetterMay,
    language: Language = "en",
    size: SheetSize = "a4",
) -> Response:
    """Create a link for each problem of a round, and return a PDF with a code for each."""
    words = words_in(language)
    with services.database.writing() as session:
        count_document(session, access.actor.known)
        row = locked_competition(session, access.gym.id, competition)
        found = round_of(session, row, one)
        problems = select(Problem).where(Problem.round_id == found.id).order_by(Problem.place)
        codes = []
        for problem in session.scalars(problems).all():
            _link, secret = make_link(session, found, problem, access.actor.known)
            address = _link_address(services, secret)
            codes.append(_code(session, found, problem, words, address))
            _log_judge_link(session, access, "judge-link.create", row, found, problem)
        if not codes:
            raise NotFoundError("judge-sheet-empty")
        names = row.name, found.name
    content, missing = judge_sheet(codes, *names, words, size)
    return document_response(
        request, content, "application/pdf", "judge-links.pdf", missing=missing
    )


@router.delete("/gyms/{gym}/competitions/{competition}/judge-links/{link}", status_code=204)
def revoke_judge_link(competition: UUID, link: UUID, session: Db, access: SetterMay) -> None:
    """Revoke a judge's link at once; repeating it is fine. Scores that came by it stay."""
    row = locked_competition(session, access.gym.id, competition)
    _revoke_link(session, access, row, link_of(session, row, link))


@router.delete("/gyms/{gym}/competitions/{competition}/rounds/{one}/judge-links", status_code=204)
def revoke_judge_links(competition: UUID, one: UUID, session: Db, access: SetterMay) -> None:
    """Revoke all judges' links of a round at once; repeating it is fine."""
    row = locked_competition(session, access.gym.id, competition)
    found = round_of(session, row, one)
    for link in links_of(session, row):
        if session.get_one(Problem, link.problem_id).round_id == found.id:
            _revoke_link(session, access, row, link)


@router.post("/judge-links/open")
def open_judge_link(
    body: OpenBody, request: Request, response: Response, services: ServicesOf, actor: BrowserMay
) -> OpenedLink:
    """Open a judge's link in this browser, under the judge's name."""
    with services.database.reading() as session:
        is_known = link_with(session, body.secret) is not None
    if not is_known:
        # All judges of a competition may open their links behind one address: only wrong secrets
        # count.
        with services.database.writing() as session:
            count_wrong_judge_link(session, network_of(request))
    with services.database.writing() as session:
        access, cookie, is_new = open_link(
            session,
            body.secret,
            body.name,
            network_of(request),
            lambda link: request.cookies.get(cookie_name(link), ""),
        )
        if is_new:
            log_change(
                session,
                "judge-link.open",
                person=None,
                gym=access.gym.id,
                subject=access.competition.name,
                competition=str(access.competition.id),
                problem=label_of(session, access.problem),
                judge=access.judge.name,
            )
    _set_cookie(response, access.link.id, cookie)
    return OpenedLink(id=access.link.id)


@router.get("/judge-links/{link}/pad")
def read_judge_pad(
    link: UUID, request: Request, response: Response, session: Db, access: JudgeByLink
) -> JudgePad:
    """Return the problem of a judge's link, the start list of its round, and the marks.

    The browser's cookie lasts from now on, so a pad that is in use does not close.
    """
    check_open(access)
    row, one, problem = access.competition, access.round, access.problem
    entries = [
        PadEntry.model_validate(entry, from_attributes=True)
        for entry, _ in starters(session, row, one)
        if not problem.category_ids or str(entry.category_id) in problem.category_ids
    ]
    has_order = row.format == Format.ROUNDS or one.quota is not None
    facts: dict[str, Any] = {
        "link_id": link,
        "judge": access.judge.name,
        "competition_id": row.id,
        "competition": row.name,
        "gym": access.gym.slug,
        "round_id": one.id,
        "round": one.name,
        "kind": one.kind,
        "state": one.state,
        "scoring": ScoringBody.model_validate(one.scoring),
        "max_attempts": one.max_attempts,
        "problem": _problem_out(session, problem),
        "entries": sorted(entries, key=lambda entry: entry.bib),
        "starters": running_order(session, row, one) if has_order else [],
        "marks": [_pad_mark(mark) for mark in problem_marks(session, row, problem.id)],
    }
    _set_cookie(response, link, request.cookies[cookie_name(link)])
    return JudgePad.model_validate(facts)


@router.put("/judge-links/{link}/events/{event}")
def put_link_event(
    link: UUID,
    event: UUID,
    body: EventBody,
    request: Request,
    response: Response,
    services: ServicesOf,
    access: JudgeByLink,
) -> PadEvent:
    """Store a score event about the link's problem, as `put_score_event` does."""
    with services.database.writing() as session:
        row = locked_competition(session, access.gym.id, access.competition.id)
        # Again, behind the lock: a link that was revoked meanwhile writes nothing more.
        judge = judge_in(session, link, request.cookies.get(cookie_name(link), "")).judge
        sender = ByLink(judge, access.problem.id)
        kept, is_new = store_event(session, row, event, body, sender)
        judge.used_at = now()
    response.status_code = 201 if is_new else 200
    with services.database.reading() as session:
        [stored] = events_out(session, access.competition.id, [kept], about=not is_new)
    return _pad_event(stored)


def _set_cookie(response: Response, link: UUID, secret: str) -> None:
    response.set_cookie(
        cookie_name(link),
        secret,
        max_age=_COOKIE_S,
        path="/",
        secure=True,
        httponly=True,
        samesite="strict",
    )


def _revoke_link(session: Session, access: Access, row: Competition, link: JudgeLink) -> None:
    if revoke_link(session, link):
        problem = session.get_one(Problem, link.problem_id)
        one = session.get_one(Round, problem.round_id)
        _log_judge_link(session, access, "judge-link.revoke", row, one, problem)


def _pad_mark(mark: ProblemMark) -> PadMark:
    facts = mark.model_dump(exclude={"events"})
    return PadMark(**facts, events=[_pad_event(event) for event in mark.events])


def _pad_event(event: EventOut) -> PadEvent:
    facts = event.model_dump(include=set(PadEvent.model_fields))
    return PadEvent.model_validate(facts | ({} if event.by_link else {"by_name": ""}))


def _link_address(services: ServicesOf, secret: str) -> str:
    return f"{services.settings.link_base}/judge#{secret}"


def _problem_out(session: Session, problem: Problem) -> ProblemOut:
    facts = ProblemOut.model_validate(problem, from_attributes=True)
    facts.label = label_of(session, problem)
    return facts


def _code(session: Session, one: Round, problem: Problem, words: Words, link: str) -> JudgeCode:
    key = "judge_route" if Scoring.of(one.scoring).is_lead else "judge_problem"
    title = words.say(key, label=label_of(session, problem))
    name = problem.name or words.colour(problem.colour)
    return JudgeCode(title, " · ".join(filter(None, (name, problem.wall))), link)


def _log_judge_link(
    session: Session, access: Access, action: str, row: Competition, one: Round, problem: Problem
) -> None:
    label = label_of(session, problem)
    log_competition(session, access, action, row, round=one.name, problem=label)
