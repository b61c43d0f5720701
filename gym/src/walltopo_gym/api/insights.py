"""What setters and owners learn of their gym, as JSON and as tables."""

from __future__ import annotations

from dataclasses import dataclass, fields
from datetime import date, datetime
from typing import Annotated, Any, Final, Literal
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
from walltopo_gym.insights.holds import Hanging, Stock, Wear, hanging_holds, stock, wear
from walltopo_gym.insights.resets import Reset, resets_of
from walltopo_gym.insights.routes import OfRoute, RouteFigures, SetterInsight, of_routes
from walltopo_gym.insights.stripping import Suggestion, what_to_strip
from walltopo_gym.insights.styles import StyleCell, StyleInsight, styles
from walltopo_gym.insights.usage import ENOUGH
from walltopo_gym.insights.wishes import Wished, aims_of, wished
from walltopo_gym.spreadsheets import csv_table
from walltopo_gym.storage.files import FileStore

router = APIRouter(tags=["insights"])

_ODD: Final = list(OddFacts.model_fields)
LearnerMay = Annotated[Access, gym_rule(Role.SETTER, Scope.READ)]
By = Literal["bands", "categories"]
Part = Literal["wishes", "routes", "setters", "strip", "odd", "styles", "holds", "stock", "wear"]


@dataclass(frozen=True)
class RouteInsight(RouteFigures):
    """A route that hangs; `due`: its holds are due for washing. What would tell of fewer than five
    people is null. Stars, flash rate and `off` (how many steps harder than its grade climbers find
    it) are shrunk."""

    due: bool

    @classmethod
    def of(cls, row: OfRoute, wash_after: int) -> RouteInsight:
        """As the platform knows it."""
        told = {field.name: getattr(row, field.name) for field in fields(RouteFigures)}
        return cls(**told, due=row.use.worn >= wash_after)


class Insights(BaseModel):
    """What hangs; `today` is the gym's day, `enough` how many people a group has at least.

    `odd` stays empty while fewer than `odd_from` routes tell of the gym's scale; `odd_graded` do.
    """

    today: date
    enough: int
    wash_after: int
    wishes: list[Wished]
    routes: list[RouteInsight]
    setters: list[SetterInsight]
    strip: list[Suggestion]
    odd: list[OddFacts]
    odd_graded: int
    odd_from: int


class GroupFacts(BaseModel):
    """Climbers of the bands or categories `parts`, put together where they were few."""

    key: str
    parts: list[str]
    size: int


class StyleInsights(BaseModel):
    """Of which days; no groups: there are not enough people to tell any apart."""

    since: datetime
    until: datetime
    groups: list[GroupFacts]
    lines: list[StyleInsight]


class HoldInsights(BaseModel):
    """Of all walls."""

    wash_after: int
    holds: list[Hanging]
    stock: list[Stock]
    wear: list[Wear]


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
def list_resets(wall: UUID, session: Db, access: LearnerMay) -> list[Reset]:
    """What each reset of a wall changed, the last one first."""
    return resets_of(session, wall_of(session, access.gym.id, wall), now())


@router.get("/gyms/{gym}/insights/{part}.csv", response_class=PlainTextResponse)
def read_insights_table(
    part: Part, session: Db, services: ServicesOf, access: LearnerMay,
    by: Annotated[By, Query(description="of styles")] = "bands",
) -> PlainTextResponse:  # fmt: skip
    """A part of it as a table."""
    if part == "styles":
        table = _styles_table(_styles(session, access.gym, by))
    else:
        kinds: dict[Part, Any] = {
            "wishes": Wished, "routes": RouteInsight, "setters": SetterInsight,
            "strip": Suggestion, "holds": Hanging, "stock": Stock, "wear": Wear,
        }  # fmt: skip
        whole: BaseModel = (
            holds_told(session, services.store, access.gym)
            if part in ("holds", "stock", "wear") else told(session, access.gym)
        )  # fmt: skip
        columns = [field.name for field in fields(kinds[part])] if part != "odd" else _ODD
        table = csv_table(columns, map(vars, getattr(whole, part)))
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
        wishes=wished(session, gym.id, aims, found.routes),
        routes=[RouteInsight.of(row, aims.wash_after) for row in found.routes],
        setters=found.setters,
        strip=strip,
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
        holds=hanging,
        stock=stock(aims, hanging),
        wear=wear(session, gym.id, aims.wash_after, routes),
    )


def _styles(session: Session, gym: Gym, by: By) -> StyleInsights:
    if gym.boards != "categories":  # who the gym does not divide is not divided here
        by = "bands"
    found = styles(session, gym, now(), by)
    return StyleInsights(
        since=found.since,
        until=found.until,
        groups=[GroupFacts(key=g.key, parts=list(g.parts), size=g.size) for g in found.groups],
        lines=found.lines,
    )


def _styles_table(found: StyleInsights) -> str:
    """A row each style and group, and one of all (the group empty)."""
    counted = [field.name for field in fields(StyleCell)]
    rows = [
        {"kind": line.kind, "value": line.value, "routes": line.routes, "group": group}
        | {name: getattr(cell, name) for name in counted}
        for line in found.lines
        for group, cell in {"": line, **line.cells}.items()
    ]
    return csv_table(["kind", "value", "routes", "group", *counted], rows)
