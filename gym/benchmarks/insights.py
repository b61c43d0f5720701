"""How soon a setter has what there is to learn.

    python -m gym.benchmarks.insights [--database URL] [--rate 1] [--seconds 60]

The gym of `reads`: 300 routes on ten walls, 4,000 climbers, 50,000 ascents, 20,000 opinions (all
made up), routes of five steepnesses, four colours, four types of hold and ten setters; in SQLite or
in an empty PostgreSQL database, server and setter on this one machine. Requests come at a fixed
rate whether or not the ones before were answered; a time counts from when the request was due.
"""

from __future__ import annotations

from collections.abc import Sequence
from uuid import UUID

import httpx
import numpy as np
from gym.benchmarks.load import Draw, Prepare, Request, measure, options
from gym.benchmarks.reads import fill
from gym.tests.worlds import Server
from sqlalchemy import select, update

from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.actor import sign_in
from walltopo_gym.climbing.counting import recount_gym
from walltopo_gym.gyms.models import GradeSystem, Gym, Membership
from walltopo_gym.publishing.models import Placement, Route

KINDS = {
    "overview": "insights",
    "styles": "insights/styles",
    "holds": "insights/holds",
    "resets": "walls/{wall}/resets",
    "routes as CSV": "insights/routes.csv",
}


def style(server: Server) -> str:
    """Let the routes differ, and give the cookie of a setter."""
    rng = np.random.default_rng(2)
    with server.database.writing() as session:
        gym = session.scalars(select(Gym)).one()
        system = session.scalars(select(GradeSystem).where(GradeSystem.gym_id == gym.id)).one()
        for number, route in enumerate(session.scalars(select(Route))):
            route.grade_system_id, route.grade = system.id, FONT[int(rng.integers(4, 15))]
            route.colour = str(rng.choice(["red", "blue", "green", "yellow"]))
            route.setter = f"Setter {number % 10}"
            types = {str(rng.choice(["jug", "crimp", "sloper", "pinch"])): 8}
            angle = float(rng.choice([-20.0, 0.0, 10.0, 30.0, 60.0]))
            placed = update(Placement).where(Placement.route_id == route.id)
            session.execute(placed.values(steepness_deg=angle, hold_types=types))
        setter = session.scalars(
            select(Membership.person_id).where(Membership.role == "setter")
        ).first()
        assert setter is not None
        cookie = sign_in(session, setter, "laptop", 1)
    recount_gym(server.database, gym.id)
    return cookie


def asking(path: str, walls: Sequence[UUID], cookie: str) -> Prepare:
    """Each of `KINDS` in turn."""

    async def prepare(client: httpx.AsyncClient) -> Draw:
        def draw(number: int) -> Request:
            kind = list(KINDS)[number % len(KINDS)]
            below = KINDS[kind].format(wall=walls[number % len(walls)])
            return Request(kind, f"{path}/{below}", cookie)

        return draw

    return prepare


def filled(server: Server) -> Prepare:
    """The gym of `reads`, whose routes differ."""
    path, walls, _ = fill(server)
    return asking(path, walls, style(server))


def main(arguments: Sequence[str] | None = None) -> int:
    args = options(__doc__, rate=1, seconds=60).parse_args(arguments)
    measure(filled, args)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
