"""Count holds on walls and free holds; find walls that are due for washing."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo_gym.insights.models import Aims, Washing
from walltopo_gym.insights.routes import OfRoute
from walltopo_gym.insights.usage import last_washed, worn_walls
from walltopo_gym.scans.artifacts import download_files
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import Wall

# Up to how many metres along the wall a hold is that large.
SIZES: Final = {"s": 0.08, "m": 0.16, "l": 0.32, "xl": float("inf")}


@dataclass(frozen=True)
class HoldCount:
    """The number of `holds` of one colour, type and size on one wall."""

    wall_id: UUID
    colour: str
    type: str
    size: str
    holds: int


@dataclass(frozen=True)
class Stock:
    """Holds of one colour and type (empty: all types): the number on walls, the gym's total (None:
    unknown), and the number of free ones (negative if more are on walls)."""

    colour: str
    type: str
    current: int
    total: int | None
    free: int | None


@dataclass(frozen=True)
class Wear:
    """A wall's last washing (None: never), the tries on current routes since then (None: of few
    people), and the number of routes that are due."""

    wall_id: UUID
    washed_at: datetime | None
    washing_id: UUID | None
    tries: int | None
    routes: int
    due: int


def current_holds(session: Session, store: FileStore, gym: UUID) -> list[HoldCount]:
    """Return the holds of the published scans, wall by wall; volumes have the type `volume`."""
    walls = session.execute(
        select(Wall.id, Wall.published_scan_id)
        .where(Wall.gym_id == gym, Wall.published_scan_id.is_not(None))
        .order_by(Wall.place, Wall.name)
    )
    return [
        HoldCount(wall, *kind, number)
        for wall, scan in walls
        if scan is not None
        for kind, number in _count_holds(store, scan)
    ]


def stock(aims: Aims, current: Sequence[HoldCount]) -> list[Stock]:
    """Return the free holds of each colour and of each of its types."""
    there: Counter[tuple[str, str]] = Counter()
    for one in current:
        there[one.colour, one.type] += one.holds
        there[one.colour, ""] += one.holds
    totals = {(row["colour"], row["type"]): int(row["total"]) for row in aims.stock}
    return [
        Stock(
            *kind,
            there[kind],
            totals.get(kind),
            None if kind not in totals else totals[kind] - there[kind],
        )
        for kind in sorted({*there, *totals})
    ]


def wear(session: Session, gym: UUID, wash_after: int, routes: Sequence[OfRoute]) -> list[Wear]:
    """Return one row for each wall with routes.

    A route's holds are due after `wash_after` tries since they were washed or put up.
    """
    last = last_washed()
    washings = {
        row.wall_id: row
        for row in session.scalars(
            select(Washing)
            .join(last, (last.c.wall_id == Washing.wall_id) & (last.c.at == Washing.washed_at))
            .join(Wall, Wall.id == Washing.wall_id)
            .where(Wall.gym_id == gym)
        )
    }
    tries = worn_walls(session, gym)
    found = []
    for wall in dict.fromkeys(route.wall_id for route in routes):
        mine = [route for route in routes if route.wall_id == wall]
        washing = washings.get(wall)
        found.append(
            Wear(
                wall_id=wall,
                washed_at=None if washing is None else washing.washed_at,
                washing_id=None if washing is None else washing.id,
                tries=tries.get(wall, 0),
                routes=len(mine),
                due=sum(route.use.worn >= wash_after for route in mine),
            )
        )
    return found


@lru_cache(maxsize=512)
def _count_holds(store: FileStore, scan: UUID) -> list[tuple[tuple[str, str, str], int]]:
    """Return colour, type and size of the holds of a published scan, which never changes."""
    with tempfile.TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        download_files(store, scan, folder, folder.holds)
        found = Holds.load(folder.holds)
    kinds = Counter(
        (
            hold.colour,
            "volume" if hold.kind == "volume" else hold.type,
            _size_name(hold.size / found.unit),
        )
        for hold in found.holds
    )
    return sorted(kinds.items())


def _size_name(metres: float) -> str:
    return next(name for name, most in SIZES.items() if metres <= most)
