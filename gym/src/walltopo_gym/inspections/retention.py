"""How long records and photos of inspections are kept."""

from __future__ import annotations

import json
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.events import RowsExpired
from walltopo_gym.inspections.models import Inspection, InspectionEntry
from walltopo_gym.inspections.photos import BELOW, photo_key
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import open_store

# After ten years no claim for a defect remains (directive (EU) 2024/2853, article 17).
_KEPT: Final = timedelta(days=3653)
# A photo is stored before its entry names it.
_YOUNG: Final = timedelta(days=1)


def drop_old_records(session: Session, question: RowsExpired) -> None:
    """Delete the finished inspections that no law asks for any more, with their names."""
    old = delete(Inspection).where(Inspection.finished_at < now() - _KEPT)
    question.found.append(len(session.scalars(old.returning(Inspection.id)).all()))


def drop_unnamed_photos(settings: GymSettings, database: Database) -> None:
    """Delete the photos that neither an entry nor a record names, but those of the last day.

    A record keeps its entries after the deletion of their wall.
    """
    store = open_store(settings)
    old = [key for key, _, written in store.entries(BELOW) if written < now() - _YOUNG]
    named = (
        select(Inspection.gym_id, Inspection.id, InspectionEntry.photo)
        .join(InspectionEntry, InspectionEntry.inspection_id == Inspection.id)
        .where(InspectionEntry.photo.is_not(None))
    )
    with database.reading() as session:
        rows = session.execute(named)
        kept = {photo_key(gym, inspection, str(photo)) for gym, inspection, photo in rows}
        left = {key for key in old if key not in kept}
        of_left = {UUID(key.split("/")[-2]) for key in left}
        finished = Inspection.id.in_(of_left) & Inspection.finished_at.is_not(None)
        for row in session.scalars(select(Inspection).where(finished)):
            photos = (entry["photo"] for entry in json.loads(row.record)["entries"])
            left -= {photo_key(row.gym_id, row.id, photo) for photo in photos if photo}
    store.drop(sorted(left))
