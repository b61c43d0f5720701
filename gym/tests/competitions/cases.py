"""A competition for each use of an endpoint; written past the API, for it is made very often."""

from __future__ import annotations

from typing import Any
from uuid import UUID, uuid4

from gym.tests.worlds import World
from sqlalchemy import select

from walltopo_gym.accounts.secrets import hash_of
from walltopo_gym.clock import now
from walltopo_gym.competitions.judge_links import cookie_name
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    JudgeLink,
    LinkJudge,
    Problem,
    Round,
)

SHEET: dict[str, Any] = {
    "categories": [{"name": "Open"}],
    "rounds": [{"name": "Session", "scoring": {"rules": "points"}, "problems": [{"name": "A"}]}],
}
CUP: dict[str, Any] = {"name": "Cup", "format": "festival"} | SHEET


def a_competition(world: World, state: str = "running") -> dict[str, Any]:
    """One with a qualification that runs, a final, and two entries, the member's the first."""
    row = Competition(
        id=uuid4(),
        gym_id=world.gym.id,
        name="Cup",
        format="rounds",
        state=state,
        waiver="I fall.",
        self_entry=True,
        self_scoring=True,
    )
    category = Category(id=uuid4(), competition_id=row.id, place=0, name="Open")
    rounds = [
        Round(
            id=uuid4(),
            competition_id=row.id,
            place=n,
            name=name,
            kind="open",
            quota=quota,
            scoring={"rules": "ifsc-2025"},
            state="waiting" if n else "running",
            begun_at=None if n else now(),
        )
        for n, (name, quota) in enumerate((("Qualification", None), ("Final", 1)))
    ]
    problem = Problem(id=uuid4(), round_id=rounds[0].id, place=0, name="A", category_ids=[])
    entries = [
        Entry(
            competition_id=row.id,
            category_id=category.id,
            bib=n,
            name=f"Climber {n}",
            person_id=person,
        )
        for n, person in enumerate((world.people["member"].id, None), 1)
    ]
    with world.server.database.writing() as session:
        for rows in ([row], [category, *rounds], [problem, *entries]):
            session.add_all(rows)
            session.flush()
    return {"competition": row.id}


def of_last(world: World, kind: Any, place: int = 0) -> UUID:
    """A row of the competition of this gym that was made last."""
    newest = select(Competition.id).where(Competition.gym_id == world.gym.id)
    newest = newest.order_by(Competition.created_at.desc()).limit(1)
    with world.server.database.reading() as session:
        rows = select(kind).where(kind.competition_id == session.scalar(newest))
        order = kind.bib if kind is Entry else kind.place
        found: UUID = session.scalars(rows.order_by(order)).all()[place].id
        return found


def with_row(kind: Any, name: str, place: int = 0) -> Any:
    """Values of a path: a competition, and one of its rows by that name."""

    def values(world: World) -> dict[str, Any]:
        return a_competition(world) | {name: of_last(world, kind, place)}

    return values


def a_problem(world: World) -> dict[str, Any]:
    made = a_competition(world)
    one = of_last(world, Round)
    with world.server.database.reading() as session:
        return made | {"problem": session.scalar(select(Problem.id).where(Problem.round_id == one))}


def a_judge_link(world: World) -> dict[str, Any]:
    """A competition with a judge's link, which a browser has opened."""
    made = a_problem(world)
    link = JudgeLink(
        id=uuid4(), problem_id=made["problem"], token_hash="", person_id=world.owner.id
    )
    link.token_hash = hash_of(_secret(link.id))
    judge = LinkJudge(link_id=link.id, name="Eva", token_hash=hash_of(f"cookie-{link.id}"))
    with world.server.database.writing() as session:
        session.add(link)
        session.flush()
        session.add(judge)
    return made | {"link": link.id}


def _secret(link: UUID) -> str:
    return f"secret-of-{link}"


def _last_link(world: World) -> UUID:
    newest = select(JudgeLink.id).order_by(JudgeLink.created_at.desc()).limit(1)
    with world.server.database.reading() as session:
        return session.scalars(newest).one()


def secret_of(world: World) -> str:
    """The secret of the last link."""
    return _secret(_last_link(world))


def cookie_of(world: World) -> str:
    """The cookie of a browser that has opened the last link."""
    link = _last_link(world)
    return f"{cookie_name(link)}=cookie-{link}"


def an_event_by_link(world: World) -> dict[str, Any]:
    return a_judge_link(world) | {"event": uuid4()}


def an_event(world: World) -> dict[str, Any]:
    return a_competition(world) | {"event": uuid4()}


def an_ended_competition(world: World) -> dict[str, Any]:
    return a_competition(world, "ended")


def a_top(world: World) -> dict[str, Any]:
    """Return a top of the member, sent by them or for them."""
    with world.server.database.reading() as session:
        one = of_last(world, Round)
        problem = session.scalar(select(Problem.id).where(Problem.round_id == one))
    moment = now().isoformat()
    return {
        "entry_id": str(of_last(world, Entry)),
        "problem_id": str(problem),
        "kind": "top",
        "n": 1,
        "device": "phone",
        "number": 1,
        "made_at": moment,
        "sent_at": moment,
    }


def a_competitor(world: World) -> dict[str, Any]:
    return {"name": "Uma", "category_id": str(of_last(world, Category))}


def oneself(world: World) -> dict[str, Any]:
    return {"category_id": str(of_last(world, Category)), "waiver": "I fall."}


def a_sheet(world: World) -> dict[str, Any]:
    """With the category in which there are entries."""
    return SHEET | {"categories": [{"id": str(of_last(world, Category)), "name": "All"}]}


def an_order(world: World) -> dict[str, Any]:
    return {"category_id": str(of_last(world, Category)), "entry_ids": [str(of_last(world, Entry))]}


def two_of_them(world: World) -> str:
    return f"?first={of_last(world, Entry)}&second={of_last(world, Entry, 1)}"
