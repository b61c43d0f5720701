"""Endpoints of finished inspections as documents and tables, of the check of a record, and of the
history of a hold."""

from __future__ import annotations

from contextlib import suppress
from datetime import date, datetime
from typing import Annotated, Any
from uuid import UUID

from fastapi import APIRouter, Path, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel

from walltopo_gym.accounts.access import AnyoneMay
from walltopo_gym.accounts.limits import count_document
from walltopo_gym.api.documents import DocumentTurn, document_response
from walltopo_gym.api.fields import Digits
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.tables import CsvDialectOf, CsvFile
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.days import gym_day, zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.inspections.http.plans import InspectorMay
from walltopo_gym.inspections.levels import Level
from walltopo_gym.inspections.models import Inspection
from walltopo_gym.inspections.paper import RecordPaper
from walltopo_gym.inspections.photos import read_photo
from walltopo_gym.inspections.record import Result, record_file, verify_code
from walltopo_gym.inspections.service import inspection_of
from walltopo_gym.inspections.signing import key_name
from walltopo_gym.inspections.tables import record_csv
from walltopo_gym.languages import Language
from walltopo_gym.publishing.hold_history import history_of
from walltopo_gym.publishing.version_holds import check_version
from walltopo_gym.walls.lookup import wall_of

router = APIRouter(tags=["inspections"])

_PDF = "application/pdf"
_FILE: dict[int | str, dict[str, Any]] = {
    200: {"content": {_PDF: {"schema": {"type": "string", "format": "binary"}}}}
}


class VerifiedInspection(BaseModel):
    """The facts of a record that its code reveals, without names of people.

    `is_signed`: the signature of the stored record is right. `key`: short name of its key.
    `late`: number of entries that arrived after it and are not signed. `corrected_by`: the code of
    the latest correction.
    """

    gym: str
    level: Level
    finished_on: date
    result: Result
    code: str
    key: str
    is_signed: bool
    late: int
    corrected_by: str | None


class HoldMomentOut(BaseModel):
    """Something that happened to a hold.

    `kind`: "set", "rescanned", "turned" and "moved" by its `note`, "reported" with its `fault`,
    "report-closed", "wall-washed", or a mark of an inspection. `person`: a name, empty if unknown.
    """

    at: datetime
    kind: str
    note: str
    person: str
    fault: str
    inspection: UUID | None


@router.get(
    "/gyms/{gym}/inspections/{inspection}/record.pdf", response_class=Response, responses=_FILE
)
def read_inspection_paper(
    inspection: UUID,
    request: Request,
    _: DocumentTurn,
    services: ServicesOf,
    access: InspectorMay,
    language: Language = "en",
) -> Response:
    """Return the record of a finished inspection as PDF, with its code and a link to check it."""
    with services.database.writing() as session:
        count_document(session, access.actor.known)
    with services.database.reading() as session:
        row = _finished(session, access.gym.id, inspection)
        file = record_file(session, row)
        corrected = session.get(Inspection, row.corrects_id) if row.corrects_id else None
        gym = session.get_one(Gym, access.gym.id)

    def photo(name: str) -> bytes | None:
        with suppress(NotFoundError):
            return read_photo(services.store, row, name)
        return None

    paper = RecordPaper(
        file=file,
        zone=zone_of(gym),
        photo=photo,
        base=services.settings.link_base,
        corrected=None if corrected is None else corrected.record,
        size="letter" if gym.paper == "letter" else "a4",
    )
    content, missing = paper.pdf(language)
    name = f"{gym.slug}-inspection-{row.code}.pdf"
    return document_response(request, content, _PDF, name, shown=True, missing=missing)


@router.get("/gyms/{gym}/inspections/{inspection}/record.json")
def read_inspection_file(inspection: UUID, session: Db, access: InspectorMay) -> JSONResponse:
    """Return the signed record of a finished inspection for `walltopo gym inspections verify`,
    and the entries that arrived after it."""
    row = _finished(session, access.gym.id, inspection)
    headers = {"content-disposition": f'attachment; filename="inspection-{row.code}.json"'}
    return JSONResponse(record_file(session, row), headers=headers)


@router.get("/gyms/{gym}/inspections/{inspection}/record.csv", response_class=CsvFile)
def read_inspection_table(
    inspection: UUID, session: Db, access: InspectorMay, dialect: CsvDialectOf
) -> CsvFile:
    """Return the entries of a finished inspection as a table."""
    row = _finished(session, access.gym.id, inspection)
    return CsvFile.of(f"inspection-{row.code}", record_csv(record_file(session, row), dialect))


@router.get("/inspections/{code}")
def verify_inspection(
    code: Annotated[str, Path(max_length=40)], session: Db, actor: AnyoneMay
) -> VerifiedInspection:
    """Check the code of a printed record."""
    found = verify_code(session, code)
    row, record = found.inspection, found.record
    assert row.code is not None
    finished = datetime.fromisoformat(record["finished"]["at"])
    return VerifiedInspection(
        gym=record["gym"]["name"],
        level=Level(record["level"]),
        finished_on=gym_day(finished, zone_of(found.gym)),
        result=Result(record["result"]),
        code=row.code,
        key=key_name(row.public_key),
        is_signed=found.is_signed,
        late=found.late,
        corrected_by=found.corrected_by,
    )


@router.get("/gyms/{gym}/walls/{wall}/versions/{scan}/holds/{hold}/history")
def read_hold_history(
    wall: UUID,
    scan: UUID,
    hold: Annotated[Digits, Path(ge=1, le=65535)],
    session: Db,
    services: ServicesOf,
    access: InspectorMay,
) -> list[HoldMomentOut]:
    """Return what happened to a hold of a version, over earlier and later versions, the latest
    first: at most 50 moments."""
    row = wall_of(session, access.gym.id, wall)
    check_version(session, row, scan)
    found = history_of(session, services.store, row, scan, hold)
    return [HoldMomentOut(**vars(moment)) for moment in found]


def _finished(session: Db, gym: UUID, inspection: UUID) -> Inspection:
    row = inspection_of(session, gym, inspection)
    if row.finished_at is None:
        raise ConflictError("inspection-unfinished")
    return row
