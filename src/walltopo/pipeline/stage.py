"""What a stage is: declared inputs and outputs, settings, and a function between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from walltopo.scans.artifacts import Artifact, artifacts_of


@dataclass(frozen=True)
class Stage:
    """One stage of a scan.

    Parameters
    ----------
    name : section of the settings, and entry in `scan.json`.
    reads, writes : dataclasses whose fields are declared by `walltopo.scans.artifacts.of`;
        `writes` has the stage's figures besides, as `metrics`. A stage cannot read anything else.
    run : a function of `reads`, the stage's settings and a `Context` that returns `writes`.
    check : raises, before the first stage begins, if this machine lacks what the settings ask for.
    version : raised when the code changes so that old results must be recomputed.
    """

    name: str
    reads_type: type[Any]
    writes_type: type[Any]
    run: Callable[[Any, Any, Any], Any]
    check: Callable[[Any], None] = field(default=lambda settings: None)
    version: int = 1

    @cached_property
    def reads(self) -> tuple[Artifact[Any], ...]:
        """Return the artifacts that the stage is given."""
        return tuple(item for _, item in artifacts_of(self.reads_type))

    @cached_property
    def writes(self) -> tuple[Artifact[Any], ...]:
        """Return the artifacts that the stage makes."""
        return tuple(item for _, item in artifacts_of(self.writes_type))
