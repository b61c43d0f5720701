"""Endpoints of insights for setters and owners, as JSON and CSV, and of the gym's aims."""

from __future__ import annotations

from dataclasses import dataclass, fields
from datetime import date, datetime
from typing import Annotated, Any, Final, Literal
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.fields import Body, Name, Text
from walltopo_gym.api.grades import GradeBounds
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.tables import CsvDialectOf, CsvFile
from walltopo_gym.clock import now
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.errors import NotFoundError, RequestError
from walltopo_gym.events import NO_OUTLIERS, GradeOutlier, GradeOutliersOf, collect_answers
from walltopo_gym.gyms.access import Access, SetterMay, gym_rule
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.insights.grade_targets import (
    GradeTarget,
    LackingGrade,
    aims_of,
    check_targets,
    grade_targets,
    lacking_grades,
)
from walltopo_gym.insights.holds import HoldCount, Stock, Wear, current_holds, stock, wear
from walltopo_gym.insights.models import Aims, Washing
from walltopo_gym.insights.resets import Reset, resets_of
from walltopo_gym.insights.routes import OfRoute, RouteFigures, SetterInsight, routes_insight
from walltopo_gym.insights.stripping import Suggestion, what_to_strip
from walltopo_gym.insights.styles import StyleCell, StyleInsight, styles
from walltopo_gym.insights.usage import ENOUGH
from walltopo_gym.spreadsheets import CsvDialect, csv_table
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.lookup import wall_of

router = APIRouter(tags=["insights"])


class GradeOutlierOut(GradeBounds):
    """A route whose grade lies outside of the range that its movement and the gym's other grades
    suggest: "soft" if the grade is above, "hard" if it is below, by `by` steps of the Font scale.
    """

    route_id: UUID
    side: Literal["soft", "hard"]
    by: int

    @classmethod
    def from_row(cls, outlier: GradeOutlier) -> GradeOutlierOut:
        """Return the message of an outlier."""
        ends = GradeBounds.of(outlier.range).model_dump()
        return cls(route_id=outlier.route, side=outlier.side, by=outlier.by, **ends)


_OUTLIER: Final = list(GradeOutlierOut.model_fields)

LearnerMay = Annotated[Access, gym_rule(Role.SETTER, Scope.READ)]

By = Literal["bands", "categories"]

Part = Literal[
    "targets", "routes", "setters", "strip", "outliers", "styles", "holds", "stock", "wear"
]


@dataclass(frozen=True)
class RouteInsight(RouteFigures):
    """A current route; `due`: its holds are due for washing. Figures of fewer than five people are
    null. Stars, flash rate and `off` (steps by which climbers find it harder than its grade) are
    shrunk."""

    due: bool

    @classmethod
    def of(cls, row: OfRoute, wash_after: int) -> RouteInsight:
        """Return the message of a route's figures."""
        values = {field.name: getattr(row, field.name) for field in fields(RouteFigures)}
        return cls(**values, due=row.use.worn >= wash_after)


class Insights(BaseModel):
    """Figures of the current routes; `today` is the gym's day, `enough` the minimum group size.

    `outliers` is empty while fewer than `outliers_from` routes are graded (`outliers_graded`).
    """

    today: date
    enough: int
    wash_after: int
    targets: list[GradeTarget]
    routes: list[RouteInsight]
    setters: list[SetterInsight]
    strip: list[Suggestion]
    outliers: list[GradeOutlierOut]
    outliers_graded: int
    outliers_from: int


class GroupOut(BaseModel):
    """Climbers of the bands or categories `parts`; small ones are merged."""

    key: str
    parts: list[str]
    size: int


class StyleInsights(BaseModel):
    """Styles by groups over a period; no groups if there are too few people."""

    since: datetime
    until: datetime
    groups: list[GroupOut]
    lines: list[StyleInsight]


class HoldInsights(BaseModel):
    """Holds, stock and wear of all walls."""

    wash_after: int
    holds: list[HoldCount]
    stock: list[Stock]
    wear: list[Wear]


@router.get("/gyms/{gym}/insights")
def read_insights(session: Db, access: LearnerMay) -> Insights:
    """Return grades against targets, figures of routes and setters, and stripping suggestions."""
    return route_insights(session, access.gym)


@router.get("/gyms/{gym}/insights/styles")
def read_style_insights(session: Db, access: LearnerMay, by: By = "bands") -> StyleInsights:
    """Return which styles are climbed and liked, by groups of at least five climbers."""
    return _styles(session, access.gym, by)


@router.get("/gyms/{gym}/insights/holds")
def read_hold_insights(session: Db, services: ServicesOf, access: LearnerMay) -> HoldInsights:
    """Return holds on walls, free holds, and walls that are due for washing."""
    return hold_insights(session, services.store, access.gym)


@router.get("/gyms/{gym}/walls/{wall}/resets")
def list_resets(wall: UUID, session: Db, access: LearnerMay) -> list[Reset]:
    """Return what each reset of a wall changed, the latest first."""
    return resets_of(session, wall_of(session, access.gym.id, wall), now())


@router.get("/gyms/{gym}/walls/{wall}/lacking-grades")
def list_lacking_grades(wall: UUID, session: Db, access: LearnerMay) -> list[LackingGrade]:
    """Return what the gym's grade targets lack once all routes of a wall are stripped: the wishes
    for its reset."""
    stripped = wall_of(session, access.gym.id, wall).id
    routes = routes_insight(session, access.gym, now()).routes
    staying = [route for route in routes if route.wall_id != stripped]
    aims = aims_of(session, access.gym.id)
    return lacking_grades(grade_targets(session, access.gym.id, aims, staying))


@router.get("/gyms/{gym}/insights/{part}.csv", response_class=CsvFile)
def read_insights_table(
    part: Part,
    session: Db,
    services: ServicesOf,
    access: LearnerMay,
    dialect: CsvDialectOf,
    by: Annotated[By, Query(description="of styles")] = "bands",
) -> CsvFile:
    """Return one part of the insights as CSV."""
    if part == "styles":
        table = _styles_table(_styles(session, access.gym, by), dialect)
    else:
        kinds: dict[Part, Any] = {
            "targets": GradeTarget,
            "routes": RouteInsight,
            "setters": SetterInsight,
            "strip": Suggestion,
            "holds": HoldCount,
            "stock": Stock,
            "wear": Wear,
        }
        whole: BaseModel = (
            hold_insights(session, services.store, access.gym)
            if part in ("holds", "stock", "wear")
            else route_insights(session, access.gym)
        )
        columns = [field.name for field in fields(kinds[part])] if part != "outliers" else _OUTLIER
        table = csv_table(columns, map(vars, getattr(whole, part)), dialect)
    return CsvFile.of(part, table)


def route_insights(session: Session, gym: Gym) -> Insights:
    """Return the insights on current routes."""
    check_unlocked(_WORK)
    aims, found = aims_of(session, gym.id), routes_insight(session, gym, now())
    strip = what_to_strip(found.routes, found.today, aims.wash_after)
    found_outliers = collect_answers(session, GradeOutliersOf(gym.id))
    outliers = found_outliers[0] if found_outliers else NO_OUTLIERS
    return Insights(
        today=found.today,
        enough=ENOUGH,
        wash_after=aims.wash_after,
        targets=grade_targets(session, gym.id, aims, found.routes),
        routes=[RouteInsight.of(row, aims.wash_after) for row in found.routes],
        setters=found.setters,
        strip=strip,
        outliers=[GradeOutlierOut.from_row(row) for row in outliers.routes],
        outliers_graded=outliers.graded,
        outliers_from=outliers.enough,
    )


def hold_insights(session: Session, store: FileStore, gym: Gym) -> HoldInsights:
    """Return the insights on holds."""
    check_unlocked(_WORK)
    aims, routes = aims_of(session, gym.id), routes_insight(session, gym, now()).routes
    current = current_holds(session, store, gym.id)
    return HoldInsights(
        wash_after=aims.wash_after,
        holds=current,
        stock=stock(aims, current),
        wear=wear(session, gym.id, aims.wash_after, routes),
    )


def _styles(session: Session, gym: Gym, by: By) -> StyleInsights:
    if gym.boards != "categories":  # who the gym does not divide is not divided here
        by = "bands"
    found = styles(session, gym, now(), by)
    return StyleInsights(
        since=found.since,
        until=found.until,
        groups=[GroupOut(key=g.key, parts=list(g.parts), size=g.size) for g in found.groups],
        lines=found.lines,
    )


def _styles_table(found: StyleInsights, dialect: CsvDialect) -> str:
    """Return a row per style and group, and one of all groups (with an empty group)."""
    counted = [field.name for field in fields(StyleCell)]
    rows = [
        {"kind": line.kind, "value": line.value, "routes": line.routes, "group": group}
        | {name: getattr(cell, name) for name in counted}
        for line in found.lines
        for group, cell in {"": line, **line.cells}.items()
    ]
    return csv_table(["kind", "value", "routes", "group", *counted], rows, dialect)


_WORK: Final = "a gym's insights are computed"
Kind = Literal["", "slab", "vertical", "slight", "steep", "roof"]

Count = Annotated[int, Field(ge=0, le=100_000)]


class GradeTargetCell(Body):
    """The target number of routes of a grade, of a kind of wall (empty: any), or of both."""

    system: UUID | None = None
    grade: Text = ""
    steepness: Kind = ""
    routes: Annotated[int, Field(ge=0, le=1000)]


class GradeTargets(Body):
    """All targets; they replace the earlier ones."""

    cells: Annotated[list[GradeTargetCell], Field(max_length=500)]


class StockRow(Body):
    """The gym's number of holds of a colour and type (empty: all types)."""

    colour: Name
    type: Text = ""
    total: Count


class StockBody(Body):
    """The whole stock; `wash_after`: tries on a route until its holds are due for washing."""

    rows: Annotated[list[StockRow], Field(max_length=1000)]
    wash_after: Annotated[int, Field(ge=1, le=100_000)]


@router.put("/gyms/{gym}/insights/targets")
def put_targets(body: GradeTargets, services: ServicesOf, access: SetterMay) -> Insights:
    """Set the gym's grade targets."""
    cells = [(cell.system, cell.grade, cell.steepness) for cell in body.cells]
    with services.database.writing() as session:
        check_targets(session, access.gym.id, cells)
        aims = _read_aims(session, access)
        aims.targets = [cell.model_dump(mode="json") for cell in body.cells]
        _log_insight(session, access, "insights.targets")
    with services.database.reading() as session:
        return route_insights(session, access.gym)


@router.put("/gyms/{gym}/insights/stock")
def put_stock(body: StockBody, services: ServicesOf, access: SetterMay) -> HoldInsights:
    """Set the gym's stock of holds and its washing interval."""
    if len({(row.colour, row.type) for row in body.rows}) < len(body.rows):
        raise RequestError("stock-twice")
    with services.database.writing() as session:
        aims = _read_aims(session, access)
        aims.stock, aims.wash_after = [row.model_dump() for row in body.rows], body.wash_after
        _log_insight(session, access, "insights.stock")
    with services.database.reading() as session:
        return hold_insights(session, services.store, access.gym)


@router.post("/gyms/{gym}/walls/{wall}/washings", status_code=201)
def wash_wall(wall: UUID, services: ServicesOf, access: SetterMay) -> HoldInsights:
    """Record that a wall's holds were washed now."""
    with services.database.writing() as session:
        session.add(Washing(wall_id=wall_of(session, access.gym.id, wall).id))
        _log_insight(session, access, "wall.wash", str(wall))
    with services.database.reading() as session:
        return hold_insights(session, services.store, access.gym)


@router.delete("/gyms/{gym}/walls/{wall}/washings/{washing}")
def drop_washing(
    wall: UUID, washing: UUID, services: ServicesOf, access: SetterMay
) -> HoldInsights:
    """Delete a recorded washing."""
    with services.database.writing() as session:
        row = session.get(Washing, washing)
        if row is None or row.wall_id != wall_of(session, access.gym.id, wall).id:
            raise NotFoundError("not-there-washing")
        session.delete(row)
        _log_insight(session, access, "wall.no-wash", str(wall))
    with services.database.reading() as session:
        return hold_insights(session, services.store, access.gym)


def _read_aims(session: Session, access: Access) -> Aims:
    aims = aims_of(session, access.gym.id)
    session.add(aims)
    return aims


def _log_insight(session: Session, access: Access, action: str, subject: str = "") -> None:
    session.flush()
    access.log_change(
        session,
        action,
        subject=subject or access.gym.slug,
    )


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)
