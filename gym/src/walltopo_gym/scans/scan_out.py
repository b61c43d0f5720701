"""A scan as the API has it."""

from __future__ import annotations

from datetime import datetime
from typing import Literal
from uuid import UUID

from pydantic import BaseModel
from sqlalchemy.orm import Session

from walltopo_gym.scans.models import Scan, ScanProgress
from walltopo_gym.scans.service import State


class Progress(BaseModel):
    """The progress of a running scan: in words, and in numbers if they are known."""

    stage: str
    doing: str
    done: int
    total: int | None
    notes: list[str]
    at: datetime


class ScaleOut(BaseModel):
    """The source of a scan's metres: the method, and the labels of its scale plates."""

    method: Literal["measure", "stickers", "distance", "poses", "reference", "none"]
    metric: bool
    plates: list[str]


class NetworkFigures(BaseModel):
    """AP50 of a network's masks: holds and volumes as one class, and the mean of both."""

    masks: float
    mean: float


class NetworkResult(BaseModel):
    """A comparison with the shipped network (`before`) on photos held out from the training."""

    photos: int
    objects: int
    held_out: int
    before: NetworkFigures
    after: NetworkFigures
    better: bool


class ScanOut(BaseModel):
    """A version of a wall; `error` and `hint`: why it failed, and what to do. `part`: its photos
    show a part of the wall, and the rest is from `reference_id`. `colours`: only holds of these
    colours are exchanged; empty: all. `network`: scores of the gym's own network that found its
    holds; null: the shipped network found them."""

    id: UUID
    wall_id: UUID
    state: State
    reference_id: UUID | None
    amends_id: UUID | None
    error: str
    hint: str
    created_at: datetime
    published_at: datetime | None
    scale: ScaleOut | None
    part: bool
    colours: list[str]
    network: NetworkResult | None
    progress: Progress | None = None


def scan_out(session: Session, row: Scan) -> ScanOut:
    """Return a scan with its progress."""
    facts = ScanOut.model_validate(row, from_attributes=True)
    progress = session.get(ScanProgress, row.id)
    if progress is not None:
        facts.progress = Progress.model_validate(progress, from_attributes=True)
    return facts
