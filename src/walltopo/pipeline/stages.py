"""The stages of a scan, in order.

A stage is a room of the package. Its `contract.py` declares in three dataclasses what can be set
and, by the names of `walltopo.scans.artifacts`, what it reads and writes; its `stage.py` has

    run(reads: Reads, settings: ..., context: Context) -> Writes

and may have `check(settings)`, called before the first stage begins.

What is not declared cannot be read: a stage never sees the scan folder.
"""

from __future__ import annotations

import dataclasses
import importlib
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import Any

from walltopo.core import InputError

__all__ = ["SOURCES", "STAGES", "Stage", "stage_index", "stage_names"]

SOURCES = "sources"  # what ingest reads: files of the user, not of the scan


@dataclass(frozen=True)
class Stage:
    """One stage.

    Parameters
    ----------
    name : of its section in the settings, and in `scan.json`.
    room : the package with its `contract` and `stage` modules.
    version : raised when the code changes so that old results must be recomputed.
    """

    name: str
    room: str
    version: int = 1

    @cached_property
    def contract(self) -> ModuleType:
        """The room's light module of declarations."""
        return importlib.import_module(f"{self.room}.contract")

    @property
    def reads(self) -> tuple[str, ...]:
        """Names of the artifacts that it is given."""
        return tuple(f.name for f in dataclasses.fields(self.contract.Reads) if f.name != SOURCES)

    @property
    def writes(self) -> tuple[str, ...]:
        """Names of the artifacts that it makes."""
        fields = dataclasses.fields(self.contract.Writes)
        return tuple(f.name for f in fields if f.name != "metrics")

    def check(self, settings: Any) -> None:
        """Ask the stage whether it could run with these settings, before the others begin.

        A stage that wants more than the core (a program, a GPU, a model) has a function `check`.

        Raises
        ------
        EnvironmentLacksError : this machine lacks something; InputError : a model is unusable.
        """
        check = getattr(importlib.import_module(f"{self.room}.contract"), "check", None)
        if check is not None:
            check(settings)

    def run(self, reads: Any, settings: Any, context: Any) -> Any:
        """Call the stage: its `Reads` in, its `Writes` out."""
        return importlib.import_module(f"{self.room}.stage").run(reads, settings, context)


STAGES = (
    Stage("ingest", "walltopo.photos"),
    Stage("sparse", "walltopo.sparse"),
    Stage("scale", "walltopo.measure", version=2),
    Stage("dense", "walltopo.dense", version=4),
    Stage("texture", "walltopo.texture", version=2),
    Stage("detect", "walltopo.detect", version=2),
    Stage("lift", "walltopo.lifting"),
    Stage("propose", "walltopo.propose"),
    Stage("classify", "walltopo.holds", version=9),
    Stage("routes", "walltopo.routes", version=6),
    Stage("edit", "walltopo.edit", version=2),
    Stage("export", "walltopo.export", version=7),
)


def stage_names() -> tuple[str, ...]:
    """The stages' names, in order."""
    return tuple(stage.name for stage in STAGES)


def stage_index(name: str) -> int:
    """The place of a stage.

    Raises
    ------
    InputError : there is no such stage; names the ones there are.
    """
    if name not in stage_names():
        raise InputError(f"unknown stage {name!r}; the stages are {', '.join(stage_names())}")
    return stage_names().index(name)
