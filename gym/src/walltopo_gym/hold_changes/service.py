"""The holds on the walls that changed since the scan before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.hold_changes.models import HoldChange, HoldComparison
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.version_holds import same_mesh
from walltopo_gym.scans.models import Scan
from walltopo_gym.walls.models import Wall

_DONE_SHOWN: Final = timedelta(days=30)


@dataclass(frozen=True)
class ComparedWall:
    """A wall whose published version was compared, or waits for it.

    Parameters
    ----------
    changes : with the route of each, None for a hold without one; in the order of the routes.
    """

    wall: Wall
    comparison: HoldComparison
    changes: Sequence[tuple[HoldChange, Route | None]]


def compared_walls(
    session: Session, gym: UUID, wall: UUID | None = None, *, done: bool = False
) -> list[ComparedWall]:
    """Return the comparisons of the published versions, by wall name.

    Parameters
    ----------
    wall : of this wall alone; done : changes that were done in the last 30 days, instead of open
        ones.
    """
    walls = select(Wall).where(Wall.gym_id == gym, Wall.published_scan_id.is_not(None))
    if wall is not None:
        walls = walls.where(Wall.id == wall)
    found = []
    for row in session.scalars(walls.order_by(Wall.name, Wall.id)).all():
        comparison = _comparison_of(session, row)
        if comparison is not None:
            found.append(
                ComparedWall(row, comparison, _current_changes(session, comparison, done=done))
            )
    return found


def _comparison_of(session: Session, wall: Wall) -> HoldComparison | None:
    """Return the comparison of the published version, or of the one that it amends."""
    assert wall.published_scan_id is not None
    same = same_mesh(session, wall.id, wall.published_scan_id)
    return session.scalar(select(HoldComparison).where(HoldComparison.scan_id.in_(same)))


def _current_changes(
    session: Session, comparison: HoldComparison, *, done: bool
) -> list[tuple[HoldChange, Route | None]]:
    """Return the changes of holds that are on the wall, as far as that is known."""
    wanted = HoldChange.done_at > now() - _DONE_SHOWN if done else HoldChange.done_at.is_(None)
    rows = (
        select(HoldChange, Route)
        .outerjoin(Route, Route.id == HoldChange.route_id)
        .where(HoldChange.scan_id == comparison.scan_id, wanted, Route.stripped_at.is_(None))
        .order_by(Route.name, HoldChange.route_id, HoldChange.kind, HoldChange.hold)
    )
    return [(change, route) for change, route in session.execute(rows)]


def change_of(session: Session, gym: UUID, change: UUID) -> tuple[HoldChange, Wall]:
    """Return a change of this gym and its wall, locked for a decision.

    Raises
    ------
    NotFoundError : this gym has no such change.
    """
    row = session.get(HoldChange, change, with_for_update=True)
    wall = None
    if row is not None:
        wall = session.get_one(Wall, session.get_one(Scan, row.scan_id).wall_id)
    if row is None or wall is None or wall.gym_id != gym:
        raise NotFoundError("not-there-hold-change")
    return row, wall
