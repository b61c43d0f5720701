"""Which edit of a row is the newer one, though copies arrive late and clocks are wrong.

A copy of an edit may wait in the network for days, and arrive after the next edit did. Each device
numbers its edits, so a copy is known by its number, whatever the clocks say. Edits of two devices
are ordered by how long ago each was made when it was sent: by one and the same clock, which may be
wrong as long as it goes on. Who sends neither (a program) has the last word when it arrives.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import JSON
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now

_DEVICES: Final = 8  # so many are remembered of a row


@dataclass(frozen=True)
class Edit:
    """An edit as its device tells of it.

    Parameters
    ----------
    device : made by the browser, kept there; number : grows with each edit of this device;
    age_s : how long ago it was made when it was sent, seconds.
    """

    device: UUID
    number: int
    age_s: float


class Edited:
    """What a row remembers of its edits: when the last one that counts was made and by which
    device, and the last number of each device."""

    edited_at: Mapped[datetime | None]
    edited_by: Mapped[UUID | None]
    edits: Mapped[dict[str, int]] = mapped_column(JSON, default=dict, server_default="{}")


def takes(row: Edited, edit: Edit | None) -> bool:
    """Whether an edit is newer than what the row says; it is noted in any case."""
    at = now()
    if edit is None:
        row.edited_at, row.edited_by = at, None
        return True
    device, made = str(edit.device), at - timedelta(seconds=edit.age_s)
    known = dict(row.edits or {})
    if edit.number <= known.pop(device, 0):
        return False
    # The last one that was heard of stands last, and is forgotten last.
    row.edits = dict([*known.items(), (device, edit.number)][-_DEVICES:])
    # The server's own clock may have been set back since.
    before = None if row.edited_at is None else min(row.edited_at, at)
    if before is not None and made < before and row.edited_by != edit.device:
        return False
    row.edited_at, row.edited_by = made, edit.device
    return True
