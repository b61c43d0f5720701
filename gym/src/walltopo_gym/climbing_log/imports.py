"""Import of a log: each climb once, however often a file is imported."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import fields
from datetime import date, datetime
from typing import NamedTuple
from uuid import UUID, uuid5

from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.people import lock_person
from walltopo_gym.climbing_log.entries import climbs_of
from walltopo_gym.climbing_log.importing.lines import LogFile, LogLine
from walltopo_gym.climbing_log.models import OtherAscent
from walltopo_gym.climbing_log.other import OtherClimb, day_of
from walltopo_gym.clock import now
from walltopo_gym.texts import same_key


class PlannedLine(NamedTuple):
    """A line of a file, and whether the log has its climb already.

    Parameters
    ----------
    ascent : id of the ascent that the import makes of it.
    """

    line: LogLine
    ascent: UUID
    is_known: bool


def plan_import(session: Session, person: UUID, file: LogFile) -> list[PlannedLine]:
    """Return the fate of each line, in the file's order.

    A climb is known by the id that an earlier import gave to the same line, or because the log has
    one of the same name, location and kind on the same day: so an export of this platform adds
    nothing to the log that it came from. A file with three equal lines adds one to a log with two.
    """
    made = select(OtherAscent.id).where(OtherAscent.person_id == person)
    ids = set(session.scalars(made))
    there = Counter(
        key
        for climb in climbs_of(session, person)
        for key in _identity_keys(
            climb.day, climb.at, climb.name, climb.location, _as_imported(climb.kind)
        )
    )
    repeats: Counter[str] = Counter()
    met: Counter[tuple[object, ...]] = Counter()
    planned = []
    for line in file.lines:
        repeats[line.key] += 1
        ascent = uuid5(person, f"{file.source}\n{line.key}\n{repeats[line.key]}")
        is_known = ascent in ids
        day = day_of(line.climbed_at)
        for key in _identity_keys(day, line.climbed_at, line.name, line.location, line.kind):
            met[key] += 1
            is_known = is_known or met[key] <= there[key]
        planned.append(PlannedLine(line, ascent, is_known))
    return planned


def import_lines(session: Session, person: UUID, file: LogFile) -> list[PlannedLine]:
    """Add the climbs of a file that the log has not yet; return the fate of each line."""
    # One person's imports come one after the other, so that two at once are one.
    lock_person(session, person)
    planned = plan_import(session, person, file)
    rows = [_row_of_line(each, person, file.source) for each in planned if not each.is_known]
    if rows:
        session.execute(insert(OtherAscent), rows)
    return planned


def _as_imported(kind: str) -> str:
    return "try" if kind in ("zone", "hang", "high-point") else kind


def _identity_keys(
    day: date, at: datetime, name: str, location: str, kind: str
) -> Iterator[tuple[object, ...]]:
    facts = same_key(name), same_key(location), kind
    yield day, *facts
    yield at, *facts


def _row_of_line(planned: PlannedLine, person: UUID, source: str) -> dict[str, object]:
    return {
        "id": planned.ascent,
        "created_at": now(),
        "person_id": person,
        "source": source,
        **{field.name: getattr(planned.line, field.name) for field in fields(OtherClimb)},
    }
