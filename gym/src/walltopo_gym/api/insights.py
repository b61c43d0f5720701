"""What setters and owners learn of their gym, as JSON and as tables."""

from __future__ import annotations

from dataclasses import asdict
from datetime import date, datetime
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel
from sqlalchemy.orm import Session
from starlette.responses import PlainTextResponse

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.grade_ranges import OddFacts
from walltopo_gym.api.rules import Access, gym_rule
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.walls import wall_of
from walltopo_gym.clock import now
from walltopo_gym.grading.ranges import odd_routes
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.insights.holds import hanging_holds, stock, wear
from walltopo_gym.insights.resets import resets_of
from walltopo_gym.insights.routes import OfRoute, of_routes
from walltopo_gym.insights.stripping import what_to_strip
from walltopo_gym.insights.styles import styles
from walltopo_gym.insights.usage import ENOUGH
from walltopo_gym.insights.wishes import aims_of, wished
from walltopo_gym.spreadsheets import csv_table
from walltopo_gym.storage.files import FileStore

__all__ = ["HoldInsights", "Insights", "holds_told", "router", "told"]

router = APIRouter(tags=["insights"])

LearnerMay = Annotated[Access, gym_rule(Role.SETTER, Scope.READ)]
By = Literal["bands", "categories"]
Part = Literal["wishes", "routes", "setters", "strip", "odd", "styles", "holds", "stock", "wear"]


class WishFacts(BaseModel):
    """Routes of a grade, on a kind of wall (empty: any): how many hang, how many are wished."""

    system: UUID | None
    grade: str
    colour: str
    steepness: str
    hanging: int
    wish: int | None


class RouteInsight(BaseModel):
    """A route that hangs. What would tell of fewer than five people is null. Stars, flash rate and
    `off` (how many steps harder than its grade climbers find it) are shrunk."""

    id: UUID
    wall_id: UUID
    number: int
    name: str
    colour: str
    system: UUID | None
    grade: str
    setter: str
    steepness: str
    set_on: date
    strip_on: date | None
    age: int
    ascents: int
    climbers: int
    recent: int | None
    flash_rate: float | None
    stars: float | None
    votes: int
    crowd: str
    grade_votes: int
    off: float | None
    keep: int
    renew: int
    due: bool

    @classmethod
    def of(cls, row: OfRoute, wash_after: int) -> RouteInsight:
        """As the platform knows it."""
        fields = {name: value for name, value in vars(row).items() if name != "use"}
        return cls(
            **fields, ascents=row.use.ascents, climbers=row.use.climbers, recent=row.recent,
            due=row.use.worn >= wash_after,
        )  # fmt: skip


class SetterInsight(BaseModel):
    """A setter, over all of their routes; as of a route, else."""

    setter: str
    hanging: int
    routes: int
    ascents: int | None
    climbers: int | None
    flash_rate: float | None
    stars: float | None
    votes: int
    off: float | None
    grade_votes: int
    keep: int
    renew: int


class StripFacts(BaseModel):
    """A route to strip, and why; the first one first."""

    route_id: UUID
    reasons: list[str]
    against: list[str]


class Insights(BaseModel):
    """What hangs; `today` is the gym's day, `enough` how many people a group has at least.

    `odd` stays empty while fewer than `odd_from` routes tell of the gym's scale; `odd_graded` do.
    """

    today: date
    enough: int
    wash_after: int
    wishes: list[WishFacts]
    routes: list[RouteInsight]
    setters: list[SetterInsight]
    strip: list[StripFacts]
    odd: list[OddFacts]
    odd_graded: int
    odd_from: int


class GroupFacts(BaseModel):
    """Climbers of the bands or categories `parts`, put together where they were few."""

    key: str
    parts: list[str]
    size: int


class CellFacts(BaseModel):
    """Of one style and group; null: not told."""

    tried: int | None
    topped: int | None
    votes: int | None
    stars: float | None


class StyleInsight(CellFacts):
    """A style: a steepness, a hold that routes have most of, a colour, a length."""

    kind: str
    value: str
    routes: int
    cells: dict[str, CellFacts]


class StyleInsights(BaseModel):
    """Of which days; no groups: there are not enough people to tell any apart."""

    since: datetime
    until: datetime
    groups: list[GroupFacts]
    lines: list[StyleInsight]


class HoldFacts(BaseModel):
    """Holds of one colour, type and size (s, m, l, xl) that hang on a wall."""

    wall_id: UUID
    colour: str
    type: str
    size: str
    holds: int


class StockFacts(BaseModel):
    """Holds of one colour, and type (empty: of all): hanging, in all, free."""

    colour: str
    type: str
    hanging: int
    total: int | None
    free: int | None


class WearFacts(BaseModel):
    """A wall's holds: last washed, tries since then, and how many routes are due."""

    wall_id: UUID
    washed_at: datetime | None
    washing_id: UUID | None
    tries: int | None
    routes: int
    due: int


class HoldInsights(BaseModel):
    """Of all walls."""

    wash_after: int
    holds: list[HoldFacts]
    stock: list[StockFacts]
    wear: list[WearFacts]


class SideFacts(BaseModel):
    """A version of a wall, before or after a reset."""

    scan_id: UUID
    published_at: datetime
    routes: int
    grades: dict[str, int]
    ascents: int | None
    stars: float | None
    votes: int


class ResetFacts(BaseModel):
    """What a reset changed; ascents are those of `weeks` before and after it."""

    wall_id: UUID
    weeks: int
    stayed: int
    came: int
    went: int
    before: SideFacts
    after: SideFacts


@router.get("/gyms/{gym}/insights")
def read_insights(session: Db, access: LearnerMay) -> Insights:
    """Grades against the gym's wish, routes, setters, and what to strip next."""
    return told(session, access.gym)


@router.get("/gyms/{gym}/insights/styles")
def read_style_insights(session: Db, access: LearnerMay, by: By = "bands") -> StyleInsights:
    """Which styles are climbed and liked, by groups of at least five climbers."""
    return _styles(session, access.gym, by)


@router.get("/gyms/{gym}/insights/holds")
def read_hold_insights(session: Db, services: ServicesOf, access: LearnerMay) -> HoldInsights:
    """Which holds hang where, which are free, which are due for washing."""
    return holds_told(session, services.store, access.gym)


@router.get("/gyms/{gym}/walls/{wall}/resets")
def list_resets(wall: UUID, session: Db, access: LearnerMay) -> list[ResetFacts]:
    """What each reset of a wall changed, the last one first."""
    rows = resets_of(session, wall_of(session, access.gym.id, wall), now())
    return [ResetFacts.model_validate(asdict(row)) for row in rows]


@router.get("/gyms/{gym}/insights/{part}.csv", response_class=PlainTextResponse)
def read_insights_table(
    part: Part, session: Db, services: ServicesOf, access: LearnerMay,
    by: Annotated[By, Query(description="of styles")] = "bands",
) -> PlainTextResponse:  # fmt: skip
    """A part of it as a table."""
    if part == "styles":
        table = _styles_table(_styles(session, access.gym, by))
    else:
        kinds: dict[Part, type[BaseModel]] = {
            "wishes": WishFacts, "routes": RouteInsight, "setters": SetterInsight,
            "strip": StripFacts, "odd": OddFacts, "holds": HoldFacts, "stock": StockFacts,
            "wear": WearFacts,
        }  # fmt: skip
        whole: BaseModel = (
            holds_told(session, services.store, access.gym)
            if part in ("holds", "stock", "wear") else told(session, access.gym)
        )  # fmt: skip
        rows = [row.model_dump() for row in getattr(whole, part)]
        table = csv_table(list(kinds[part].model_fields), rows)
    headers = {"content-disposition": f'attachment; filename="{part}.csv"'}
    return PlainTextResponse(table, headers=headers, media_type="text/csv")


def told(session: Session, gym: Gym) -> Insights:
    """What hangs, and what to do about it."""
    aims, found = aims_of(session, gym.id), of_routes(session, gym, now())
    strip = what_to_strip(found.routes, found.today, aims.wash_after)
    odds = odd_routes(session, gym.id)
    return Insights(
        today=found.today,
        enough=ENOUGH,
        wash_after=aims.wash_after,
        wishes=[WishFacts(**vars(w)) for w in wished(session, gym.id, aims, found.routes)],
        routes=[RouteInsight.of(row, aims.wash_after) for row in found.routes],
        setters=[SetterInsight(**vars(row)) for row in found.setters],
        strip=[StripFacts(**asdict(row)) for row in strip],
        odd=[OddFacts.told(row) for row in odds.routes],
        odd_graded=odds.graded,
        odd_from=odds.enough,
    )


def holds_told(session: Session, store: FileStore, gym: Gym) -> HoldInsights:
    """Of the holds."""
    aims, routes = aims_of(session, gym.id), of_routes(session, gym, now()).routes
    hanging = hanging_holds(session, store, gym.id)
    return HoldInsights(
        wash_after=aims.wash_after,
        holds=[HoldFacts(**vars(row)) for row in hanging],
        stock=[StockFacts(**vars(row)) for row in stock(aims, hanging)],
        wear=[WearFacts(**vars(row)) for row in wear(session, gym.id, aims.wash_after, routes)],
    )


def _styles(session: Session, gym: Gym, by: By) -> StyleInsights:
    if gym.boards != "categories":  # who the gym does not divide is not divided here
        by = "bands"
    found = styles(session, gym, now(), by)
    return StyleInsights(
        since=found.since,
        until=found.until,
        groups=[GroupFacts(key=g.key, parts=list(g.parts), size=g.size) for g in found.groups],
        lines=[StyleInsight.model_validate(asdict(line)) for line in found.lines],
    )


def _styles_table(found: StyleInsights) -> str:
    """A row each style and group, and one of all (the group empty)."""
    counted = list(CellFacts.model_fields)
    rows = [
        {"kind": line.kind, "value": line.value, "routes": line.routes, "group": group}
        | cell.model_dump(include=set(counted))
        for line in found.lines
        for group, cell in {"": line, **line.cells}.items()
    ]
    return csv_table(["kind", "value", "routes", "group", *counted], rows)
