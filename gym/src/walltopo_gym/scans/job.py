"""Messages to and from the process that scans, as lines of JSON."""

from __future__ import annotations

from typing import TypeAlias

import msgspec


class Job(msgspec.Struct, frozen=True):
    """The task of a scanning process.

    Parameters
    ----------
    photos : folder of photos; out : the scan folder.
    settings : `section.key=value` words, over those of `config` (empty: none).
    """

    photos: str
    out: str
    config: str
    settings: list[str]


class Step(msgspec.Struct, frozen=True, tag="step"):
    """A step of a stage begins; `total` items, if known."""

    stage: str
    doing: str
    total: int | None


class Advanced(msgspec.Struct, frozen=True, tag="advanced"):
    """`count` more items are done."""

    count: int


class Noted(msgspec.Struct, frozen=True, tag="noted"):
    """A note for the setter."""

    text: str


class Ended(msgspec.Struct, frozen=True, tag="ended"):
    """A stage is done; its files are in the scan folder."""

    stage: str


class Failed(msgspec.Struct, frozen=True, tag="failed"):
    """The scan failed; `defect`: by a fault of the program."""

    message: str
    hint: str
    defect: bool


ProcessMessage: TypeAlias = Step | Advanced | Noted | Ended | Failed
