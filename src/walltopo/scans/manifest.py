"""`scan.json`: what each stage of a scan did, with which settings, on which inputs."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, TypeAlias

import msgspec

from walltopo.core import InputError
from walltopo.core.files import read_json, write_json
from walltopo.scans.document import parse

FORMAT_VERSION = 1

# Figures of a stage by name; JSON values.
Metrics: TypeAlias = dict[str, Any]


class Output(msgspec.Struct, frozen=True):
    """An artifact as its stage left it.

    Parameters
    ----------
    bytes : of the file, or of all files of the folder.
    hash : of the content; empty where the (optional) artifact was not made.
    """

    bytes: int
    hash: str


class StageRecord(msgspec.Struct):
    """One stage's last run.

    Parameters
    ----------
    state : "running" (or killed while running), "done", "failed" or "interrupted".
    seconds : wall clock of the run.
    peak_mb : peak memory of the process during the stage, MiB.
    input_hash : hash of the stage's inputs, settings and code version.
    metrics : the stage's figures.
    error : the message where it failed.
    outputs : what it wrote, by the artifacts' names; what does not match is made again.
    """

    state: Literal["running", "done", "failed", "interrupted"]
    seconds: float = 0.0
    peak_mb: float = 0.0
    input_hash: str = ""
    metrics: Metrics = {}
    error: str = ""
    outputs: dict[str, Output] = {}


class Manifest(msgspec.Struct):
    """The manifest of one scan folder.

    Parameters
    ----------
    walltopo : version of the program that wrote it.
    settings : of the last run, by section and key.
    sources : where the photos came from.
    stages : stage name to its last run.
    """

    version: int
    walltopo: str
    settings: dict[str, dict[str, Any]]
    sources: list[str]
    stages: dict[str, StageRecord]

    @classmethod
    def load(cls, path: Path) -> Manifest:
        """Read `scan.json`; an empty one where there is none.

        Raises
        ------
        InputError : the file is damaged, is no manifest or was written by a newer walltopo.
        """
        if not path.is_file():
            return cls(FORMAT_VERSION, walltopo="", settings={}, sources=[], stages={})
        data = read_json(path)
        version = data.get("version") if isinstance(data, dict) else None
        if isinstance(version, int) and version > FORMAT_VERSION:
            raise InputError(
                f"{path}: written by a newer walltopo (format {version}, this one reads up to "
                f"{FORMAT_VERSION})",
                "Upgrade walltopo.",
            )
        return parse(data, cls, str(path))

    def save(self, path: Path) -> None:
        """Write, atomically."""
        write_json(path, msgspec.to_builtins(self))
