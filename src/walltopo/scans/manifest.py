"""`scan.json`: what each stage of a scan did, with which settings, on which inputs."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from walltopo.core import InputError
from walltopo.scans.folder import read_json, write_json

__all__ = ["Manifest", "StageRecord"]

FORMAT_VERSION = 1


@dataclass
class StageRecord:
    """One stage's last run.

    Parameters
    ----------
    state : "running" (or killed while running), "done", "failed" or "interrupted".
    seconds : wall clock of the run.
    peak_mb : peak memory of the process during the stage, MiB.
    input_hash : hash of the stage's inputs, settings and code version.
    metrics : the stage's figures.
    error : the message where it failed.
    """

    state: str
    seconds: float = 0.0
    peak_mb: float = 0.0
    input_hash: str = ""
    metrics: dict[str, Any] = field(default_factory=dict[str, Any])
    error: str = ""


class Manifest:
    """The manifest of one scan folder; every change is written at once, atomically."""

    def __init__(self, path: Path, walltopo_version: str) -> None:
        self.path = path
        self.walltopo_version = walltopo_version
        self.settings: dict[str, Any] = {}
        self.sources: list[str] = []
        self.stages: dict[str, StageRecord] = {}

    @classmethod
    def open(cls, path: Path, walltopo_version: str) -> Manifest:
        """Read `scan.json`, or begin a new one where there is none.

        Raises
        ------
        InputError : the file is damaged or was written by a newer walltopo.
        """
        manifest = cls(path, walltopo_version)
        if not path.is_file():
            return manifest
        data = read_json(path)
        try:
            if data["version"] > FORMAT_VERSION:
                raise InputError(
                    f"{path}: written by a newer walltopo (format {data['version']}, "
                    f"this one reads up to {FORMAT_VERSION})",
                    "Upgrade walltopo.",
                )
            manifest.settings = data["settings"]
            manifest.sources = data["sources"]
            known = {f.name for f in dataclasses.fields(StageRecord)}
            manifest.stages = {
                name: StageRecord(**{k: v for k, v in record.items() if k in known})
                for name, record in data["stages"].items()
            }
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{path}: not a walltopo manifest ({error})") from error
        return manifest

    def save(self) -> None:
        write_json(
            self.path,
            {
                "version": FORMAT_VERSION,
                "walltopo": self.walltopo_version,
                "settings": self.settings,
                "sources": self.sources,
                "stages": {n: dataclasses.asdict(r) for n, r in self.stages.items()},
            },
        )

    def put(self, stage: str, record: StageRecord) -> None:
        self.stages[stage] = record
        self.save()
