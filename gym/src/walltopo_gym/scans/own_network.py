"""A gym's own network: trained at night from its corrected walls, used for its next scans.

Only with the owner's consent, and nothing leaves the server. `walltopo train gym` trains and
compares on a stretch of the walls that was held out; a network that is not better is dropped.
"""

from __future__ import annotations

import tempfile
import threading
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Final
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy import JSON, ForeignKey, String, exists, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from walltopo.core.files import read_json
from walltopo.scans.folder import ScanFolder
from walltopo_gym.clock import now
from walltopo_gym.database.base import Base
from walltopo_gym.database.engine import Database
from walltopo_gym.gyms.models import Gym
from walltopo_gym.jobs.queue import Failure, Job, enqueue
from walltopo_gym.scans.artifacts import download_scan
from walltopo_gym.scans.commands import run_command
from walltopo_gym.scans.models import Scan, ScanEdits
from walltopo_gym.scans.service import State
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore, hash_of_file
from walltopo_gym.walls.models import Wall

# Not tried again in the same night, unless its worker stopped.
TRAININGS: Final = Job("own-networks", at_once=1, of_one_gym=1, waits=(), restarts=3)
NIGHT: Final = range(1, 5)  # hours of the gym's day in which a training may begin
MAX_WALLS: Final = 4  # the corrected walls that were published last
_SPARE_S: Final = 3600  # beside the training itself: reading photos, the comparison


class OwnNetwork(Base):
    """A gym's own network, and whether the owner wants one.

    `basis` names the corrected scans that it was trained on, with their revisions; `result` is
    `own.json` of `walltopo train gym`, null before the first training; `key` is the network's file,
    empty unless it is better than the shipped one; `error` is why the last training failed.
    """

    __tablename__ = "own_networks"

    gym_id: Mapped[UUID] = mapped_column(
        ForeignKey("gyms.id", ondelete="CASCADE"), primary_key=True
    )
    wanted: Mapped[bool]
    basis: Mapped[list[str]] = mapped_column(JSON, default=list)
    trained_at: Mapped[datetime | None]
    result: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    key: Mapped[str] = mapped_column(String(100), default="")
    error: Mapped[str] = mapped_column(String(500), default="")


def switch_training(session: Session, gym: UUID, wanted: bool) -> OwnNetwork:
    """Turn the training on or off; turned off, the network and its figures are dropped."""
    row = session.get(OwnNetwork, gym)
    if row is None or not wanted:
        row = session.merge(
            OwnNetwork(
                gym_id=gym, wanted=wanted, basis=[], trained_at=None, result=None, key="", error=""
            )
        )
    row.wanted = wanted
    return row


def network_of(session: Session, gym: UUID) -> OwnNetwork | None:
    """Return the gym's own network, if it has one that is used."""
    row = session.get(OwnNetwork, gym)
    return row if row is not None and row.wanted and row.key else None


def is_network(session: Session, key: str) -> bool:
    """Return whether a row names this file."""
    return bool(session.scalar(select(exists().where(OwnNetwork.key == key))))


@dataclass(frozen=True)
class OwnNetworks:
    """The chore that queues trainings, and the job that carries them out."""

    settings: GymSettings
    database: Database
    store: FileStore
    stopping: threading.Event = field(default_factory=threading.Event)

    def queue_due(self) -> None:
        """Queue a training for each gym that wants one, has new corrections, and where it is
        night."""
        with self.database.writing() as session:
            rows = select(Gym, OwnNetwork).join(OwnNetwork, OwnNetwork.gym_id == Gym.id)
            for gym, row in session.execute(rows.where(OwnNetwork.wanted)).all():
                hour = now().astimezone(ZoneInfo(gym.time_zone)).hour
                basis = _training_scans(session, gym.id)
                if hour in NIGHT and basis and basis != row.basis:
                    key = f"own-network-{gym.id}-{gym.today()}"  # one try a night
                    enqueue(session, TRAININGS, str(gym.id), gym=gym.id, key=key)

    def train(self, gym: str) -> None:
        """Train a gym's own network, and keep it if it is better."""
        one = UUID(gym)
        with self.database.reading() as session:
            row = session.get(OwnNetwork, one)
            basis = _training_scans(session, one)
            if row is None or not row.wanted or not basis:
                return
        with tempfile.TemporaryDirectory() as name:
            folders = [Path(name) / str(number) for number in range(len(basis))]
            for scan, folder in zip(basis, folders, strict=True):
                download_scan(self.store, UUID(scan.partition(":")[0]), ScanFolder(folder))
            out = Path(name) / "trained"
            error = self._run(folders, out)
            result = None if error else read_json(out / "own.json")
            key = ""
            if result is not None and result["better"]:
                key = f"networks/{hash_of_file(out / 'holds.onnx')}"
                self.store.put(key, out / "holds.onnx")
        with self.database.writing() as session:
            row = session.get(OwnNetwork, one, with_for_update=True)
            if row is None or not row.wanted:  # turned off meanwhile
                return
            row.basis, row.error = basis, error
            if result is not None:
                row.trained_at, row.result, row.key = now(), result, key

    def _run(self, folders: list[Path], out: Path) -> str:
        """Run `walltopo train gym` and return why it failed, empty on success.

        Raises
        ------
        WorkerStopsError : the worker stops; the job begins again with the next one.
        """
        minutes = self.settings.own_network_minutes
        words = ["train", "gym", *map(str, folders), "-o", str(out), "--minutes", str(minutes)]
        return run_command(words, minutes * 60 + _SPARE_S, self.stopping)


def record_failure(session: Session, failure: Failure, gym: str) -> None:
    """Write down why a training failed; the next night tries again."""
    row = session.get(OwnNetwork, UUID(gym))
    if row is not None:
        row.error = failure.shown[:500]


def _training_scans(session: Session, gym: UUID) -> list[str]:
    """Return the corrected scans of a gym to train on, with the revisions of their edits."""
    rows = (
        select(Scan.id, ScanEdits.revision)
        .join(ScanEdits, ScanEdits.scan_id == Scan.id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == gym, Scan.state == State.PUBLISHED, ScanEdits.revision > 0)
        .order_by(Scan.published_at.desc(), Scan.id)
        .limit(MAX_WALLS)
    )
    return [f"{scan}:{revision}" for scan, revision in session.execute(rows)]
