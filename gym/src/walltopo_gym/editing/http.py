"""Endpoints of the editor of a scan in review, as `walltopo view --edit` has them (docs/edits.md).

`<wall-topo edit=".../editor/log">` uses them; the sign-in replaces the token.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Final
from uuid import UUID

from fastapi import APIRouter, Body, Query, Response

from walltopo.editing.http import (
    CropsOut,
    LogOut,
    PreviewIn,
    PreviewOut,
    SaveIn,
    SaveOut,
    json_response,
    parse_place,
)
from walltopo.editing.messages import RebuildStatus
from walltopo.scans.document import parse
from walltopo_climb.editor import EaseIn, ProposeIn, adjust_grade_on, propose_on
from walltopo_gym.api.services import Services, ServicesOf
from walltopo_gym.editing.service import EditSessions, OpenScan
from walltopo_gym.errors import RequestError
from walltopo_gym.gyms.access import Access, PublisherMay
from walltopo_gym.scans.artifacts import read_carried
from walltopo_gym.scans.edits import read_log
from walltopo_gym.scans.service import check_in_review, scan_of

router = APIRouter(tags=["editing"])

_VERSION: Final = re.compile("[0-9]{1,18}")

JsonBody = Annotated[dict[str, Any], Body()]


@router.get("/gyms/{gym}/scans/{scan}/editor/log", response_model=None)
def read_edit_log(scan: UUID, services: ServicesOf, access: PublisherMay) -> Response:
    """Return the edit log of a scan in review, and its version."""
    _run_in_review(services, access, scan)
    with services.database.reading() as session:
        saved = read_log(session, scan)
    log = saved.log if saved.revision else read_carried(services.store, scan)
    version = str(saved.revision)
    return json_response(LogOut(version, log), version)


@router.post("/gyms/{gym}/scans/{scan}/editor/log", response_model=None)
def save_edit_log(
    scan: UUID, body: JsonBody, services: ServicesOf, access: PublisherMay
) -> Response:
    """Save an edit log that is based on a version, and start applying it."""
    request = parse(body, SaveIn, "edits")
    if not _VERSION.fullmatch(request.version):
        raise RequestError("edits-version")
    opened = _open_scan(services, access, scan)
    result, version = opened.save(request.edits, request.version, access.actor.known)
    return json_response(SaveOut(result, version), version)


@router.post("/gyms/{gym}/scans/{scan}/editor/log/try", response_model=None)
def try_edit_log(
    scan: UUID, body: JsonBody, services: ServicesOf, access: PublisherMay
) -> Response:
    """Return the state that an edit log leads to; change nothing."""
    request = parse(body, PreviewIn, "edits")
    result = _open_scan(services, access, scan).session.preview(request.edits)
    return json_response(PreviewOut(result))


@router.post("/gyms/{gym}/scans/{scan}/editor/log/problems", response_model=None)
def propose_problems(
    scan: UUID, body: JsonBody, services: ServicesOf, access: PublisherMay
) -> Response:
    """Return proposed problems on the holds after an edit log; change nothing."""
    request = parse(body, ProposeIn, "spec")
    session = _open_scan(services, access, scan).session
    return json_response(propose_on(session, request.edits, request.spec))


@router.post("/gyms/{gym}/scans/{scan}/editor/log/ease", response_model=None)
def ease_route(scan: UUID, body: JsonBody, services: ServicesOf, access: PublisherMay) -> Response:
    """Return the hold that makes a route one grade easier or harder; change nothing."""
    request = parse(body, EaseIn, "route")
    session = _open_scan(services, access, scan).session
    return json_response(adjust_grade_on(session, request.edits, request.route, request.way))


@router.get("/gyms/{gym}/scans/{scan}/editor/log/state", response_model=None)
def read_edit_state(scan: UUID, services: ServicesOf, access: PublisherMay) -> Response:
    """Return whether the scan's files show the saved log."""
    _run_in_review(services, access, scan)
    with services.database.reading() as session:
        saved = read_log(session, scan)
    if not saved.is_pending:
        return json_response(RebuildStatus(False, False, str(saved.shown), ""))
    return json_response(_open_scan(services, access, scan).state())


@router.get("/gyms/{gym}/scans/{scan}/editor/photos", response_model=None)
def read_edit_photos(
    scan: UUID,
    services: ServicesOf,
    access: PublisherMay,
    at: Annotated[str, Query(max_length=100, description="x,y,z in metres")] = "",
) -> Response:
    """Return crops of the photos that show a point of the wall best."""
    opened = _open_scan(services, access, scan)
    place = parse_place(at)
    if place is None:
        raise RequestError("expected-place")
    return json_response(CropsOut(opened.session.crops(place)))


def _run_in_review(services: Services, access: Access, scan: UUID) -> int:
    """Return the run of a scan that is in review."""
    with services.database.reading() as session:
        row = scan_of(session, access.gym.id, scan)
        check_in_review(row.state)
        return row.run


def _open_scan(services: Services, access: Access, scan: UUID) -> OpenScan:
    return services.get(EditSessions).of(scan, _run_in_review(services, access, scan))


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)
