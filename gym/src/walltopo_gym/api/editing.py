"""The editor of a scan in review, as `walltopo view --edit` speaks it (docs/edits.md).

`<wall-topo edit=".../editor/log">` uses it; the sign-in stands for the token.
"""

from __future__ import annotations

from typing import Annotated, Any
from uuid import UUID

import msgspec
from fastapi import APIRouter, Body, Query
from fastapi.responses import JSONResponse
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo.editing.messages import Crop, RebuildStatus
from walltopo.scans.document import Label, parse
from walltopo.scans.edits import EditLog, Place
from walltopo_climb.problems.ease import Way
from walltopo_climb.problems.wish import Wish
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.routes import PublisherMay
from walltopo_gym.api.rules import Access
from walltopo_gym.api.scans import scan_of
from walltopo_gym.api.services import Services, ServicesOf
from walltopo_gym.editing.log import read_log, save_log
from walltopo_gym.editing.opened import Opened
from walltopo_gym.errors import ConflictError
from walltopo_gym.publishing.models import Plan
from walltopo_gym.scans.states import check_in_review


class _Plain(JSONResponse):
    """Of msgspec's classes, as they are sent by `walltopo view`."""

    def render(self, content: object) -> bytes:
        return msgspec.json.encode(content)


router = APIRouter(tags=["editing"], default_response_class=_Plain)


class _Try(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    edits: EditLog


class _Save(_Try, frozen=True, forbid_unknown_fields=True):
    version: str


class _Propose(_Try, frozen=True, forbid_unknown_fields=True):
    wish: Wish


class _Ease(_Try, frozen=True, forbid_unknown_fields=True):
    route: Label
    way: Way


Asked = Annotated[dict[str, Any], Body()]


@router.get("/gyms/{gym}/scans/{scan}/editor/log", response_model=None)
def read_edit_log(scan: UUID, services: ServicesOf, access: PublisherMay) -> _Plain:
    """The log of edits and its version, for a scan in review."""
    _check(services, access, scan)
    with services.database.reading() as session:
        saved = read_log(session, scan)
    return _Plain({"version": str(saved.revision), "edits": saved.log})


@router.post("/gyms/{gym}/scans/{scan}/editor/log", response_model=None)
def save_edit_log(scan: UUID, body: Asked, services: ServicesOf, access: PublisherMay) -> _Plain:
    """Save a log that was made on a version, and begin what follows from it."""
    asked = parse(body, _Save, "edits")
    if not asked.version.isdecimal():
        raise InputError("edits: the version is none that was given out")
    opened = _opened(services, access, scan)
    result = opened.tried(asked.edits)  # before it is saved: one that cannot be replayed is refused
    with services.database.writing() as session:
        revision = save_log(session, scan, asked.edits, int(asked.version))
        _check_unplanned(session, scan)
        log_change(session, "scan.edit", person=access.actor.known, gym=access.gym.id,
                   subject=str(scan))  # fmt: skip
    opened.carry_out()
    return _Plain({"version": str(revision), "result": result})


@router.post("/gyms/{gym}/scans/{scan}/editor/log/try", response_model=None)
def try_edit_log(scan: UUID, body: Asked, services: ServicesOf, access: PublisherMay) -> _Plain:
    """What a log makes of the scan; changes nothing."""
    asked = parse(body, _Try, "edits")
    return _Plain({"result": _opened(services, access, scan).tried(asked.edits)})


@router.post("/gyms/{gym}/scans/{scan}/editor/log/problems", response_model=None)
def propose_problems(scan: UUID, body: Asked, services: ServicesOf, access: PublisherMay) -> _Plain:
    """Problems for a wish, on the holds of the wall as a log makes it; changes nothing."""
    asked = parse(body, _Propose, "wish")
    return _Plain(_opened(services, access, scan).proposed(asked.edits, asked.wish))


@router.post("/gyms/{gym}/scans/{scan}/editor/log/ease", response_model=None)
def ease_route(scan: UUID, body: Asked, services: ServicesOf, access: PublisherMay) -> _Plain:
    """Which hold makes a route one grade easier or harder; changes nothing."""
    asked = parse(body, _Ease, "route")
    return _Plain(_opened(services, access, scan).eased(asked.edits, asked.route, asked.way))


@router.get("/gyms/{gym}/scans/{scan}/editor/log/state", response_model=None)
def read_edit_state(scan: UUID, services: ServicesOf, access: PublisherMay) -> _Plain:
    """Whether the scan's files show what is saved."""
    _check(services, access, scan)
    with services.database.reading() as session:
        saved = read_log(session, scan)
    if not saved.is_pending:
        return _Plain(RebuildStatus(False, False, str(saved.shown), ""))
    return _Plain(_opened(services, access, scan).state())


@router.get("/gyms/{gym}/scans/{scan}/editor/photos", response_model=None)
def read_edit_photos(
    scan: UUID, services: ServicesOf, access: PublisherMay,
    at: Annotated[str, Query(max_length=100, description="x,y,z in metres")] = "",
) -> _Plain:  # fmt: skip
    """A place of the wall in the photos that show it best."""
    opened = _opened(services, access, scan)
    try:
        place = msgspec.convert([float(part) for part in at.split(",")], Place)
    except (ValueError, msgspec.ValidationError) as error:
        raise InputError("expected ?at=x,y,z in metres") from error
    crops: list[Crop] = opened.crops(place)
    return _Plain({"photos": crops})


def _check(services: Services, access: Access, scan: UUID) -> None:
    with services.database.reading() as session:
        check_in_review(scan_of(session, access.gym.id, scan).state)


def _check_unplanned(session: Session, scan: UUID) -> None:
    """A plan names routes and holds as they were confirmed; edits would change them behind it."""
    if session.get(Plan, scan) is not None:
        raise ConflictError("the publication of this scan is planned", "Take the plan back first.")


def _opened(services: Services, access: Access, scan: UUID) -> Opened:
    _check(services, access, scan)
    return services.desks.of(scan)
