"""Finish an inspection: its record is written once and signed."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.people import names_by_id
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.inspections.entries import ItemMark, entries_of, late_entries
from walltopo_gym.inspections.models import Inspection, InspectionEntry
from walltopo_gym.inspections.service import inspected_walls
from walltopo_gym.inspections.signing import (
    Signature,
    canonical_text,
    code_of,
    is_signed,
    read_code,
    sign_text,
)
from walltopo_gym.inspections.tables import latest_facts

FORMAT: Final = "walltopo-inspection/1"


class Result(StrEnum):
    """Results of an inspection."""

    PASSED = "passed"
    DEFECTS = "defects"
    CLOSED = "closed"


def finish_inspection(
    session: Session, gym: Gym, row: Inspection, person: UUID, result: Result, remarks: str
) -> None:
    """Finish an inspection, and sign its record by the person's key.

    Parameters
    ----------
    row : locked.

    Raises
    ------
    ConflictError : it is finished. RequestError : it passed although the latest mark of an item is
        a defect.
    """
    if row.finished_at is not None:
        raise ConflictError("inspection-finished", "inspection-correct")
    entries = entries_of(session, row.id)
    names = names_by_id(session, [row.person_id, person, *(entry.person_id for entry in entries)])
    facts = [entry_facts(entry, names) for entry in entries]
    if result == Result.PASSED and any(
        entry["mark"] == ItemMark.DEFECT for entry in latest_facts(facts)
    ):
        raise RequestError("inspection-has-defects", "inspection-other-result")
    row.finished_at, row.finished_by = now(), person
    row.result, row.remarks = result.value, remarks
    row.record = canonical_text(_signed_record(session, gym, row, facts, names))
    signed = sign_text(session, person, row.record)
    row.public_key, row.signature = signed.public_key, signed.signature
    row.code = code_of(row.record)
    session.flush()


def _signed_record(
    session: Session,
    gym: Gym,
    row: Inspection,
    facts: list[dict[str, Any]],
    names: Mapping[UUID | None, str],
) -> dict[str, Any]:
    assert row.finished_at is not None
    return {
        "format": FORMAT,
        "id": str(row.id),
        "gym": {"id": str(gym.id), "name": gym.name},
        "level": row.level,
        "checklist": row.checklist,
        "walls": [
            {
                "id": str(wall.wall_id),
                "name": wall.name,
                "scan_id": None if wall.scan_id is None else str(wall.scan_id),
            }
            for wall in inspected_walls(session, row.id)
        ],
        "started": {"at": row.created_at.isoformat(), "by": names.get(row.person_id, "")},
        "finished": {"at": row.finished_at.isoformat(), "by": names.get(row.finished_by, "")},
        "result": row.result,
        "remarks": row.remarks,
        "corrects": None if row.corrects_id is None else str(row.corrects_id),
        "entries": facts,
    }


def names_of(
    session: Session, row: Inspection, entries: Collection[InspectionEntry]
) -> Mapping[UUID | None, str]:
    """Return the names of an inspection's people whose accounts exist."""
    authors = (entry.person_id for entry in entries)
    return names_by_id(session, [row.person_id, row.finished_by, *authors])


def entry_facts(entry: InspectionEntry, names: Mapping[UUID | None, str]) -> dict[str, Any]:
    """Return an entry as a record has it."""
    return {
        "id": str(entry.id),
        "wall_id": str(entry.wall_id),
        "item": entry.item,
        "hold": entry.hold,
        "mark": entry.mark,
        "note": entry.note,
        "photo": entry.photo,
        "at": entry.made_at.isoformat(),
        "by": names.get(entry.person_id, ""),
    }


@dataclass(frozen=True)
class Verified:
    """A record that was found by its code.

    Parameters
    ----------
    record : as it was signed. is_signed : code and signature are of this record.
    late : number of entries that arrived after it.
    corrected_by : code of the latest finished correction, or None.
    """

    gym: Gym
    inspection: Inspection
    record: dict[str, Any]
    is_signed: bool
    late: int
    corrected_by: str | None


def verify_code(session: Session, given: str) -> Verified:
    """Return the record of a code in any spelling.

    Raises
    ------
    NotFoundError : no record has it, or its gym has turned inspections off.
    """
    code = read_code(given)
    row = None
    if code is not None:
        row = session.scalar(select(Inspection).where(Inspection.code == code))
    gym = None if row is None else session.get_one(Gym, row.gym_id)
    if row is None or gym is None or not gym.has("inspections"):
        raise NotFoundError("inspection-code-unknown", "inspection-code-check")
    corrected = (
        select(Inspection.code)
        .where(Inspection.corrects_id == row.id, Inspection.finished_at.is_not(None))
        .order_by(Inspection.finished_at.desc())
    )
    return Verified(
        gym=gym,
        inspection=row,
        record=json.loads(row.record),
        is_signed=code_of(row.record) == code and is_signed(row.record, signature_of(row)),
        late=late_entries(session, row.id),
        corrected_by=session.scalars(corrected.limit(1)).first(),
    )


def signature_of(row: Inspection) -> Signature:
    """Return the signature of a finished inspection."""
    return Signature(row.public_key, row.signature)


def record_file(session: Session, row: Inspection) -> dict[str, Any]:
    """Return a finished inspection as a file for `check_file`: its record, the signature, and the
    entries that arrived later, which are not signed."""
    late = entries_of(session, row.id, late=True)
    names = names_of(session, row, late)
    return {
        "record": json.loads(row.record),
        "public_key": row.public_key,
        "signature": row.signature,
        "code": row.code,
        "late": [entry_facts(entry, names) for entry in late],
    }


@dataclass(frozen=True)
class CheckedFile:
    """A record whose signature is right: its text, its code and its key."""

    text: str
    code: str
    public_key: str
    record: dict[str, Any]


def check_file(content: bytes) -> CheckedFile | None:
    """Return the record of an exported file; None if its signature is not of its record.

    Raises
    ------
    ValueError : it is no such file.
    """
    file = json.loads(content)
    if not isinstance(file, dict) or not isinstance(file.get("record"), dict):
        raise ValueError("no record")
    if file["record"].get("format") != FORMAT:
        raise ValueError("another format")
    text = canonical_text(file["record"])
    by = Signature(str(file.get("public_key")), str(file.get("signature")))
    if not is_signed(text, by):
        return None
    return CheckedFile(text, code_of(text), by.public_key, file["record"])
