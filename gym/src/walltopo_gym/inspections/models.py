"""Tables of inspections: the gym's plan, each inspection with its entries, and signing keys."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, BigInteger, ForeignKey, Index, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed

_GYM = "gyms.id"
_PERSON = "people.id"
_INSPECTION = "inspections.id"


class InspectionPlan(Base):
    """A gym's levels of inspection; nothing is due before an owner saves a plan.

    `levels`: rows of {"level", "interval_days", "checklist"}; `interval_days` is null for a level
    that the gym does not plan. `created_at`: walls without an inspection are due since then.
    """

    __tablename__ = "inspection_plans"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    levels: Mapped[list[dict[str, Any]]] = mapped_column(JSON)
    created_at: Mapped[datetime] = mapped_column(default=now)


class Inspection(Keyed, Base):
    """An inspection of some walls, which never changes once it is finished.

    `level`: one of `levels.Level`. `checklist`: its items at the start. `person_id` began it,
    `finished_by` finished it. `corrects_id`: the finished inspection that this one corrects.
    `result`: one of `record.Result`, empty until it is finished. `record`: the signed text
    (record.py), with the names of its authors; `code`: the first part of its hash, for people.
    """

    __tablename__ = "inspections"
    __table_args__ = (
        Index("ix_inspections_of_gym", "gym_id", "created_at"),
        Index("ix_inspections_code", "code", unique=True),
    )

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"))
    level: Mapped[str] = mapped_column(String(12))
    checklist: Mapped[list[str]] = mapped_column(JSON)
    person_id: Mapped[UUID | None] = mapped_column(
        ForeignKey(_PERSON, ondelete="SET NULL"), index=True
    )
    corrects_id: Mapped[UUID | None] = mapped_column(
        ForeignKey(_INSPECTION, ondelete="SET NULL"), index=True
    )
    finished_at: Mapped[datetime | None] = mapped_column(index=True)
    finished_by: Mapped[UUID | None] = mapped_column(
        ForeignKey(_PERSON, ondelete="SET NULL"), index=True
    )
    result: Mapped[str] = mapped_column(String(10), default="")
    remarks: Mapped[str] = mapped_column(String(2000), default="")
    record: Mapped[str] = mapped_column(Text, default="")
    public_key: Mapped[str] = mapped_column(String(44), default="")
    signature: Mapped[str] = mapped_column(String(88), default="")
    code: Mapped[str | None] = mapped_column(String(16))


class InspectedWall(Base):
    """A wall of an inspection, which outlives it: its id, name and place are copied at the start.
    `scan_id`: its published version then, which has the ids of the marked holds, null without one.
    """

    __tablename__ = "inspected_walls"

    inspection_id: Mapped[UUID] = mapped_column(
        ForeignKey(_INSPECTION, ondelete="CASCADE"), primary_key=True
    )
    wall_id: Mapped[UUID] = mapped_column(primary_key=True, index=True)
    scan_id: Mapped[UUID | None]
    name: Mapped[str] = mapped_column(String(80))
    place: Mapped[int]


class InspectionEntry(Keyed, Base):
    """A mark of an item of the checklist at a wall, or of a hold. It never changes, and outlives
    its wall: the latest one of an item or hold counts. The phone makes `id`, so that it is stored
    once.

    `item`: number in the checklist, null for a hold; `hold`: its id in the version `scan_id`, null
    for an item. `mark`: one of `entries.ItemMark` or `entries.HoldMark`. `photo`: hash of its
    photo. `made_at`: when it was made, by its age on arrival. `device` and `number` order the
    entries of one phone, however long each was on its way; null for programs. `late`: it arrived
    after the inspection was finished, and is no part of its record.
    """

    __tablename__ = "inspection_entries"
    __table_args__ = (
        Index("ix_inspection_entries_of_inspection", "inspection_id", "made_at"),
        Index("ix_inspection_entries_of_hold", "scan_id", "hold"),
    )

    inspection_id: Mapped[UUID] = mapped_column(ForeignKey(_INSPECTION, ondelete="CASCADE"))
    wall_id: Mapped[UUID]
    scan_id: Mapped[UUID | None]
    person_id: Mapped[UUID | None] = mapped_column(
        ForeignKey(_PERSON, ondelete="SET NULL"), index=True
    )
    item: Mapped[int | None]
    hold: Mapped[int | None]
    mark: Mapped[str] = mapped_column(String(10))
    note: Mapped[str] = mapped_column(String(300), default="")
    photo: Mapped[str | None] = mapped_column(String(64))
    made_at: Mapped[datetime]
    device: Mapped[UUID | None]
    number: Mapped[int | None] = mapped_column(BigInteger)
    late: Mapped[bool]


class InspectionKey(Base):
    """A person's Ed25519 key, which the server keeps and signs with for them (RFC 8032).

    `secret` and `public_key` are base64.
    """

    __tablename__ = "inspection_keys"

    person_id: Mapped[UUID] = mapped_column(
        ForeignKey(_PERSON, ondelete="CASCADE"), primary_key=True
    )
    secret: Mapped[str] = mapped_column(String(44))
    public_key: Mapped[str] = mapped_column(String(44))
    created_at: Mapped[datetime] = mapped_column(default=now)
