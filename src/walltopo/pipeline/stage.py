"""Define a stage: declared inputs and outputs, settings, and the function between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from walltopo.scans.artifacts import Artifact, artifacts_of, scans_of


@dataclass(frozen=True)
class Cost:
    """The typical seconds of a stage: fixed, per photo and per pair of photos.

    The stages' values are lines through two scans on two cores without a GPU: the demo (20 photos)
    and `gym-a` (72 photos), from their `scan.json`. The lift is not linear and uses their mean.
    """

    fixed: float
    per_photo: float
    per_pair: float = 0.0

    def of(self, photos: int) -> float:
        """Return the typical seconds for a number of photos."""
        pairs = photos * (photos - 1) / 2
        return self.fixed + self.per_photo * photos + self.per_pair * pairs


@dataclass(frozen=True)
class Stage:
    """One stage of a scan.

    Parameters
    ----------
    name : name of the entry in `scan.json`, and of the settings section unless `section` is given.
    reads_type, writes_type : dataclasses whose fields `walltopo.scans.artifacts.of` declares;
        `writes_type` also has the stage's `metrics`. A stage cannot read anything else, but other
        scans that `walltopo.scans.artifacts.scan_of` declares.
    run : function of the inputs, the stage's settings and a `Context` that returns the outputs.
    check : raises, before the first stage starts, if this machine lacks what the settings need.
    version : increased when a code change makes old results invalid.
    models : files of `walltopo/models` that the stage uses; their content is an input.
    cost : typical duration, for the forecast.
    section : name of the settings section; "": the stage's name.
    """

    name: str
    reads_type: type[Any]
    writes_type: type[Any]
    run: Callable[[Any, Any, Any], Any]
    check: Callable[[Any], None] = field(default=lambda settings: None)
    version: int = 1
    models: tuple[str, ...] = ()
    cost: Cost = Cost(1, 0)
    section: str = ""

    @property
    def settings_section(self) -> str:
        """Return the name of the settings section."""
        return self.section or self.name

    def settings_of(self, settings: Any) -> Any:
        """Return the section of the stage in all settings."""
        return getattr(settings, self.settings_section)

    @cached_property
    def reads(self) -> tuple[Artifact[Any], ...]:
        """Return the artifacts that the stage reads of its own scan."""
        return tuple(item for _, item in artifacts_of(self.reads_type))

    @cached_property
    def reads_elsewhere(self) -> tuple[tuple[str, Artifact[Any]], ...]:
        """Return the artifacts that the stage reads of other scans, each with the scan's name."""
        return tuple(
            (scan, item)
            for _, scan, bundle in scans_of(self.reads_type)
            for _, item in artifacts_of(bundle)
        )

    @cached_property
    def writes(self) -> tuple[Artifact[Any], ...]:
        """Return the artifacts that the stage writes."""
        return tuple(item for _, item in artifacts_of(self.writes_type))
