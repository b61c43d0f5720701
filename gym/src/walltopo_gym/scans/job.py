"""What the process that scans is asked, and what it says; lines of JSON."""

from __future__ import annotations

from typing import TypeAlias

import msgspec


class Job(msgspec.Struct, frozen=True):
    """Scan these photos.

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
    """Something of a stage begins; `total` items, where that is known."""

    stage: str
    doing: str
    total: int | None


class Advanced(msgspec.Struct, frozen=True, tag="advanced"):
    """So many items more are done."""

    count: int


class Noted(msgspec.Struct, frozen=True, tag="noted"):
    """Something that a setter may want to know."""

    text: str


class Ended(msgspec.Struct, frozen=True, tag="ended"):
    """A stage is done, its files are in the scan folder."""

    stage: str


class Failed(msgspec.Struct, frozen=True, tag="failed"):
    """The scan came to nothing; `defect`: by a fault of the program."""

    message: str
    hint: str
    defect: bool


Said: TypeAlias = Step | Advanced | Noted | Ended | Failed
