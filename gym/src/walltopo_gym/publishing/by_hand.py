"""Routes that setters add without a scan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any, Final, NamedTuple
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.errors import ConflictError, RequestError
from walltopo_gym.events import RoutesAdded, publish_event
from walltopo_gym.gyms.grade_labels import own_label
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.publishing.models import Route
from walltopo_gym.spreadsheets import MAX_SHOWN
from walltopo_gym.texts import same_key
from walltopo_gym.walls.models import Wall

MAX_ROUTES: Final = 1_000


@dataclass(frozen=True)
class HandRoute:
    """A route to add.

    Parameters
    ----------
    id : chosen by the sender, so that a repeated request adds nothing.
    facts : columns of `Route`.
    """

    id: UUID
    facts: Mapping[str, Any]


class FactError(NamedTuple):
    """An error in a fact of a route."""

    column: str
    error: RequestError


class Grades:
    """The grade systems of a gym, by which labels of grades are found."""

    def __init__(self, session: Session, gym: UUID) -> None:
        rows = session.scalars(select(GradeSystem).where(GradeSystem.gym_id == gym))
        self._systems = sorted(rows, key=lambda row: row.name)

    def find(self, label: str, system: str) -> tuple[UUID, str]:
        """Return the grade system's id and its label for a grade as somebody wrote it.

        Parameters
        ----------
        system : name of the system; empty: the only one that has the grade.

        Raises
        ------
        RequestError : no system has the grade, or several have it.
        """
        among = [row for row in self._systems if not system or _is_same(row.name, system)]
        names = ", ".join(row.name for row in self._systems)
        if not among:
            raise RequestError(
                "cell-no-system", "cell-systems", name=system[:MAX_SHOWN], names=names
            )
        exact = [row for row in among if label in row.labels]
        meant = [
            (row, own)
            for row in exact or among
            if (own := own_label(row.kind, row.labels, label)) is not None
        ]
        if not meant:
            grades = ", ".join(known for row in among for known in row.labels)
            raise RequestError(
                "cell-no-grade", "grade-known", grade=label[:MAX_SHOWN], grades=grades
            )
        if len(meant) > 1:
            several = ", ".join(row.name for row, _ in meant)
            raise RequestError("cell-grade-twice", "cell-system-column", grade=label, names=several)
        [(row, own)] = meant
        return row.id, own


def _is_same(one: str, other: str) -> bool:
    return same_key(one) == same_key(other)


def check_facts(facts: Mapping[str, Any]) -> list[FactError]:
    """Return what is wrong with the facts of a new route, besides its grade."""
    wrong = []
    if not facts["name"] and not facts["colour"]:
        wrong.append(FactError("name", RequestError("route-no-name", "route-name-it")))
    strips: date | None = facts["strip_on"]
    if strips is not None and strips < facts["set_on"]:
        error = RequestError("strip-before-set", "strip-later", day=strips, set_on=facts["set_on"])
        wrong.append(FactError("strip_on", error))
    return wrong


def add_routes(session: Session, wall: Wall, routes: Sequence[HandRoute]) -> list[Route]:
    """Add routes to a wall, or none if one cannot be added; return them in their order.

    A route whose id is known on this wall was added by an earlier copy of the request: it stays as
    it is.

    Raises
    ------
    ConflictError : an id belongs to a route of another wall. RequestError : an id comes twice.
    """
    if len({route.id for route in routes}) < len(routes):
        raise RequestError("route-twice")
    # Two copies of a request come one after the other.
    session.refresh(wall, with_for_update=True)
    rows, is_changed = [], False
    for route in routes:
        row = session.get(Route, route.id)
        if row is None:
            row = Route(id=route.id, wall_id=wall.id, by_hand=True, **route.facts)
            session.add(row)
            is_changed = True
        elif row.wall_id != wall.id:
            raise ConflictError("id-taken", "id-another")
        rows.append(row)
    if is_changed:
        wall.revision += 1
        publish_event(session, RoutesAdded(wall.gym_id, wall.id))
    session.flush()
    return rows
