"""The history of a hold over the versions of its wall, as all slices know it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.errors import RequestError
from walltopo_gym.events import HoldHistoryOf, HoldMoment, collect_answers
from walltopo_gym.publishing.version_holds import holds_between, origins, version_holds
from walltopo_gym.publishing.versions import versions_of
from walltopo_gym.scans.models import Scan
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import Wall

_MAX_VERSIONS: Final = 20  # the latest ones, in which a hold is looked for
_MAX_MOMENTS: Final = 50


def history_of(
    session: Session, store: FileStore, wall: Wall, scan: UUID, hold: int
) -> list[HoldMoment]:
    """Return what happened to a hold of a version, the latest first.

    Raises
    ------
    RequestError : the version has no such hold.
    """
    check_unlocked("finding a hold in earlier versions")
    if hold not in version_holds(store, scan).by_id:
        raise RequestError("hold-unknown")
    places = _places_of(session, store, wall, scan, hold)
    since = min(
        at for at in session.scalars(select(Scan.published_at).where(Scan.id.in_(places))) if at
    )
    question = HoldHistoryOf(wall.id, places, since, _MAX_MOMENTS)
    found = collect_answers(session, question)
    return sorted(found, key=lambda moment: moment.at, reverse=True)[:_MAX_MOMENTS]


def _places_of(
    session: Session, store: FileStore, wall: Wall, scan: UUID, hold: int
) -> Mapping[UUID, int]:
    """Return the hold's id in each of the latest versions that has it, this one included."""
    places, known = {scan: hold}, origins(session, wall.id)
    for version in versions_of(session, wall.id)[-_MAX_VERSIONS:]:
        if version.id != scan:
            there = holds_between(store, known, scan, version.id).get(hold)
            if there is not None:
                places[version.id] = there
    return places


def add_versions(session: Session, question: HoldHistoryOf) -> None:
    """Answer with the publications since the hold is on the wall; amendments are none."""
    rows = select(Scan).where(
        Scan.id.in_(question.places), Scan.amends_id.is_(None), Scan.published_at.is_not(None)
    )
    versions = session.scalars(rows.order_by(Scan.published_at, Scan.id)).all()
    for number, version in enumerate(versions):
        if version.published_at is not None:
            kind = "rescanned" if number else "set"
            question.found.append(HoldMoment(version.published_at, kind))
