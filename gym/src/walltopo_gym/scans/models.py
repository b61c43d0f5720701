"""Tables of scans, their photos, the overlap of photos, and edits."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import JSON, BigInteger, ForeignKey, String, false
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed


class Scan(Keyed, Base):
    """A version of a wall.

    `state` is one of `states.State`; `run` counts its jobs; `batches` counts its batches of photo
    checks; `reference_id` is the scan that defines its coordinate frame; `amends_id` is the version
    that an amendment corrects; `error` and `hint` say in plain words what went wrong; `scale` says
    where the metres come from (stages.py) and is null before they are known; `distance` is a
    distance that a setter measured (distance.py); `moves` says which
    routes have suggested moves (publishing/moves.py) and is null before they are computed. `part`:
    the photos show a part of the wall, and the rest is taken from the reference. `colours`: only
    holds of these colours are exchanged; empty: all. `network` says which network of the gym's own
    found its holds (own_network.py); null: the shipped one.
    """

    __tablename__ = "scans"

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"), index=True)
    made_by: Mapped[UUID | None] = mapped_column(ForeignKey("people.id", ondelete="SET NULL"))
    state: Mapped[str] = mapped_column(String(12), index=True)
    run: Mapped[int] = mapped_column(default=0)
    batches: Mapped[int] = mapped_column(default=0)
    reference_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("scans.id", ondelete="SET NULL"), index=True
    )
    amends_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("scans.id", ondelete="SET NULL"), index=True
    )
    error: Mapped[str] = mapped_column(String(2000), default="")
    hint: Mapped[str] = mapped_column(String(2000), default="")
    files: Mapped[dict[str, Any]] = mapped_column(JSON, default=dict)
    scale: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    distance: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    part: Mapped[bool] = mapped_column(default=False, server_default=false())
    colours: Mapped[list[str]] = mapped_column(JSON, default=list, server_default="[]")
    moves: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    network: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    published_at: Mapped[datetime | None]


class ScanProgress(Base):
    """The progress of a running scan, updated in place; `at`: time of the last update."""

    __tablename__ = "scan_progress"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    stage: Mapped[str] = mapped_column(String(20), default="")
    doing: Mapped[str] = mapped_column(String(200), default="")
    done: Mapped[int] = mapped_column(default=0)
    total: Mapped[int | None]
    notes: Mapped[list[str]] = mapped_column(JSON, default=list)
    at: Mapped[datetime] = mapped_column(default=now)


MAX_THUMBNAILS: Final = 12  # of one video, spread over it


class Photo(Keyed, Base):
    """A photo of a scan, or a video.

    `state`: "receiving" until complete, "received" until checked, then "usable" or "unusable" with
    the `reason`. `batch`: the number of its batch of checks. `sha256` is the sender's claim until
    then. `frames` is 1 for a photo; for a video, the number of frames that a scan takes.
    `plate_frames`: how many of the frames that have a thumbnail show a scale plate.
    """

    __tablename__ = "photos"

    scan_id: Mapped[UUID] = mapped_column(ForeignKey("scans.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(200))
    size: Mapped[int] = mapped_column(BigInteger)
    state: Mapped[str] = mapped_column(String(10), index=True)
    reason: Mapped[str] = mapped_column(String(500), default="")
    batch: Mapped[int | None]
    sha256: Mapped[str | None] = mapped_column(String(64), index=True)
    width: Mapped[int | None]
    height: Mapped[int | None]
    sharpness: Mapped[float | None]
    frames: Mapped[int] = mapped_column(default=1, server_default="1")
    plate_frames: Mapped[int] = mapped_column(default=0, server_default="0")

    @property
    def original(self) -> str:
        """Return the key of the uploaded file with all of its metadata, for scans alone."""
        return f"originals/{self.sha256}"

    @property
    def thumbnail(self) -> str:
        """Return the key of its thumbnail, which has no metadata."""
        return self.thumbnail_of(0)

    def thumbnail_of(self, number: int) -> str:
        """Return the key of a thumbnail of the photo (0), or of one of a video's frames."""
        return f"thumbnails/{self.sha256}{f'-{number}' if number else ''}.jpg"

    @property
    def thumbnails(self) -> list[str]:
        """Return the keys of all thumbnails."""
        return [self.thumbnail_of(number) for number in range(min(self.frames, MAX_THUMBNAILS))]


class PhotoOverlap(Base):
    """The photos of a scan that show the same part of the wall.

    `requested` counts the changes of the photos; `groups` belong to change number `answered`. A
    group is a list of photo ids. Groups are sorted by size; with too many photos there are none.
    `shifts`: how far the view moved between two overlapping photos, as `ingest.overlap.Shift`.
    `gaps`: pairs of photos between which another one would join two groups.
    """

    __tablename__ = "photo_overlaps"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    requested: Mapped[int]
    answered: Mapped[int]
    groups: Mapped[list[list[str]]] = mapped_column(JSON)
    shifts: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list)
    gaps: Mapped[list[list[str]]] = mapped_column(JSON, default=list, server_default="[]")


class ScanEdits(Base):
    """The setters' corrections of a scan.

    `log` is `walltopo.scans.edits.EditLog` as plain values; `revision` counts the saves; `shown` is
    the revision that the scan's files show.
    """

    __tablename__ = "scan_edits"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    revision: Mapped[int] = mapped_column(default=0)
    shown: Mapped[int] = mapped_column(default=0)
    log: Mapped[dict[str, Any]] = mapped_column(JSON)
