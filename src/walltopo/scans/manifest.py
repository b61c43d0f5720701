"""`scan.json`: the last run of each stage of a scan, with its settings and inputs."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, TypeAlias

import msgspec

from walltopo.core import InputError
from walltopo.core.files import read_json, write_json
from walltopo.scans.document import parse
from walltopo.scans.joined import Joined

FORMAT_VERSION = 1

# Figures of a stage by name; JSON values.
Metrics: TypeAlias = dict[str, Any]


class Output(msgspec.Struct, frozen=True):
    """An artifact after its stage.

    Parameters
    ----------
    bytes : of the file, or of all files of the folder.
    hash : of the content; empty if the (optional) artifact was not written.
    """

    bytes: int
    hash: str


class StageRecord(msgspec.Struct):
    """The record of one stage's last run.

    Parameters
    ----------
    state : "running" (or killed while running), "done", "failed" or "interrupted".
    seconds : wall clock of the run.
    peak_mb : peak memory of the process during the stage, MiB.
    input_hash : hash of the stage's inputs, settings and code version.
    elsewhere : hashes of the inputs outside of the scan, by path; those of a reference count on
        when the reference is deleted.
    metrics : the stage's figures.
    error : the message of a failure.
    outputs : artifacts it wrote, by name; an artifact that does not match is made again.
    """

    state: Literal["running", "done", "failed", "interrupted"]
    seconds: float = 0.0
    peak_mb: float = 0.0
    input_hash: str = ""
    elsewhere: dict[str, str] = {}
    metrics: Metrics = {}
    error: str = ""
    outputs: dict[str, Output] = {}


class Manifest(msgspec.Struct):
    """The manifest of one scan folder.

    Parameters
    ----------
    walltopo : version of the program that wrote it.
    settings : settings of the last run, by section and key.
    sources : where the photos came from.
    stages : stage name to its last run.
    joined : what a partial rescan replaced that an older walltopo joined in place, with the
        reference's files over its own; its stages before `edit` never run again. Newer ones have
        `joined.json`.
    """

    version: int
    walltopo: str
    settings: dict[str, dict[str, Any]]
    sources: list[str]
    stages: dict[str, StageRecord]
    joined: Joined | None = None

    @classmethod
    def load(cls, path: Path) -> Manifest:
        """Return the manifest of a file; an empty one if the file is missing.

        Raises
        ------
        InputError : the file is damaged, not a manifest or written by a newer walltopo.
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
        """Write the file, atomically."""
        write_json(path, msgspec.to_builtins(self))
