"""Order the edits of a row, although copies arrive late and clocks are wrong.

A copy of an edit may wait in the network for days and arrive after the next edit. Each device
numbers its edits, so copies are recognised by number, whatever the clocks say. Edits of two devices
are ordered by their age when sent, measured by one clock each, which may be wrong if it runs
evenly. An edit without either (of a program) wins when it arrives.
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
    """An edit's origin, as its device sends it.

    Parameters
    ----------
    device : an id that the browser keeps; number : grows with each edit of this device.
    age_s : age of the edit when it was sent, in seconds.
    """

    device: UUID
    number: int
    age_s: float


class Edited:
    """The stored edit state of a row: time and device of the winning edit, and the last number of
    each device."""

    edited_at: Mapped[datetime | None]
    edited_by: Mapped[UUID | None]
    edits: Mapped[dict[str, int]] = mapped_column(JSON, default=dict, server_default="{}")


def is_newer_edit(row: Edited, edit: Edit | None) -> bool:
    """Return whether an edit is newer than the row; its number is stored in any case."""
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
