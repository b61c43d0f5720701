"""The tools of the MCP server. Each reads, as its person, through the services of the API."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeVar
from uuid import UUID

from fastapi import Request
from pydantic import Field
from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Actor, Scope
from walltopo_gym.api.fields import Body
from walltopo_gym.climbing.tallies import tallies
from walltopo_gym.events import LoggedClimbs, collect_answers
from walltopo_gym.gyms.access import visible_gym
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.versions import gym_routes, route_of, wall_routes
from walltopo_gym.texts import same_key
from walltopo_gym.walls.lookup import wall_of, walls_of
from walltopo_gym.walls.models import Wall

_MOST: Final = 200  # items of a result
Arguments = TypeVar("Arguments", bound=Body)


@dataclass(frozen=True)
class Caller:
    """The program that calls a tool.

    Parameters
    ----------
    actor : of its token.
    """

    session: Session
    actor: Actor
    request: Request

    def gym(self, slug: str) -> Gym:
        """Return a gym that the person may see.

        Raises
        ------
        NotFoundError : there is no such gym for this person.
        """
        return visible_gym(self.session, slug, self.actor, self.request)[0]


@dataclass(frozen=True)
class Tool:
    """A tool.

    Parameters
    ----------
    title : for people; about : for the assistant.
    arguments : the model of its arguments; scope : that the token needs.
    """

    title: str
    about: str
    arguments: type[Body]
    run: Callable[[Caller, Any], Mapping[str, Any]]
    scope: Scope = Scope.READ


class FindGyms(Body):
    """A search for gyms."""

    words: str = Field("", max_length=100, description="part of a gym's name or place")


class OfGym(Body):
    """A gym."""

    gym: str = Field(max_length=60, description="slug of the gym, from find_gyms")


class OfWall(OfGym):
    """A gym, or one of its walls."""

    wall: UUID | None = Field(None, description="id of a wall, from list_walls; null: all walls")


class OfRoute(OfGym):
    """A route of a gym."""

    route: UUID = Field(description="id of the route, from list_routes")


class OfLogbook(Body):
    """A part of the logbook."""

    most: int = Field(50, ge=1, le=_MOST, description="number of the latest entries")


def _find_gyms(caller: Caller, wanted: FindGyms) -> dict[str, Any]:
    mine = select(Membership.gym_id).where(Membership.person_id == caller.actor.known)
    seen = select(Gym).where(or_(Gym.visibility == "public", Gym.id.in_(mine)))
    words = same_key(wanted.words).split()
    found = [
        {"slug": gym.slug, "name": gym.name, "place": gym.place}
        for gym in caller.session.scalars(seen.order_by(Gym.name))
        if all(word in same_key(f"{gym.name} {gym.place}") for word in words)
    ]
    return {"gyms": found[:_MOST], "left_out": max(0, len(found) - _MOST)}


def _list_walls(caller: Caller, wanted: OfGym) -> dict[str, Any]:
    gym = caller.gym(wanted.gym)
    walls = [
        {"id": str(wall.id), "name": wall.name, "zone": wall.zone}
        for wall in walls_of(caller.session, gym.id)
    ]
    return {"walls": walls}


def _list_routes(caller: Caller, wanted: OfWall) -> dict[str, Any]:
    gym = caller.gym(wanted.gym)
    if wanted.wall is None:
        rows = gym_routes(caller.session, gym.id)
    else:
        rows = wall_routes(caller.session, wall_of(caller.session, gym.id, wanted.wall))
    found = [_route_rows(route) for route, _ in rows]
    return {"routes": found[:_MOST], "left_out": max(0, len(found) - _MOST)}


def _route_rows(route: Route) -> dict[str, Any]:
    return {
        "id": str(route.id),
        "wall": str(route.wall_id),
        "name": route.name,
        "grade": route.grade,
        "colour": route.colour,
        "setter": route.setter,
        "tags": route.tags,
        "set_on": route.set_on.isoformat(),
        "strip_on": route.strip_on and route.strip_on.isoformat(),
        "disciplines": list(route.disciplines),
    }


def _read_route(caller: Caller, wanted: OfRoute) -> dict[str, Any]:
    session = caller.session
    route = route_of(session, caller.gym(wanted.gym).id, wanted.route)
    wall = session.get_one(Wall, route.wall_id)
    tally = tallies(session, [route.id])[route.id]
    shown = (Placement.route_id == route.id, Placement.scan_id == wall.published_scan_id)
    placed = session.scalar(select(Placement).where(*shown))
    style: dict[str, Any] = {}
    if placed is not None:
        style = {
            "steepness_deg": placed.steepness_deg,
            "hold_types": placed.hold_types,
            "height_m": placed.height_m,
        }
    return {
        **_route_rows(route),
        **style,
        "wall_name": wall.name,
        "is_current": route.stripped_at is None,
        "ascents": tally.ascents,
        "climbers": tally.climbers,
        "stars": tally.stars,
    }


def _read_logbook(caller: Caller, wanted: OfLogbook) -> dict[str, Any]:
    climbs = collect_answers(caller.session, LoggedClimbs(caller.actor.known))
    climbs.sort(key=lambda climb: (climb.at, climb.id), reverse=True)
    entries = [
        {
            "day": climb.day.isoformat(),
            "name": climb.name,
            "grade": climb.grade,
            "kind": climb.kind,
            "tries": climb.tries,
            "location": climb.location,
            "discipline": climb.discipline,
            "note": climb.note,
            "route": climb.route and str(climb.route),
        }
        for climb in climbs[: wanted.most]
    ]
    return {"entries": entries, "left_out": len(climbs) - len(entries)}


TOOLS: Final[Mapping[str, Tool]] = {
    "find_gyms": Tool(
        "Find gyms",
        "List climbing gyms on this server by name or place: public ones and the person's own.",
        FindGyms,
        _find_gyms,
    ),
    "list_walls": Tool("List walls", "List the walls of a gym.", OfGym, _list_walls),
    "list_routes": Tool(
        "List routes",
        "List the current routes of a gym or a wall with grade, colour, setter and dates.",
        OfWall,
        _list_routes,
    ),
    "read_route": Tool(
        "Read a route",
        "Read a route with its style, its wall, and how many people climbed it.",
        OfRoute,
        _read_route,
    ),
    "read_logbook": Tool(
        "Read my logbook",
        "Read the person's own latest ascents, in all gyms and outdoors.",
        OfLogbook,
        _read_logbook,
    ),
}
