"""`scan.json`: the last run of each stage of a scan, with its settings and inputs."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, TypeAlias

import msgspec

from walltopo.core import InputError
from walltopo.core.files import read_json, write_json
from walltopo.scans.document import Label, parse
from walltopo.scans.edits import Place

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
    metrics : the stage's figures.
    error : the message of a failure.
    outputs : artifacts it wrote, by name; an artifact that does not match is made again.
    """

    state: Literal["running", "done", "failed", "interrupted"]
    seconds: float = 0.0
    peak_mb: float = 0.0
    input_hash: str = ""
    metrics: Metrics = {}
    error: str = ""
    outputs: dict[str, Output] = {}


class Joined(msgspec.Struct, frozen=True):
    """The parts of its reference that a partial rescan replaced (`sparse.part`).

    Parameters
    ----------
    replaced_share : share of the reference's surface that the new photos replaced.
    seam_mm : 95th percentile of the distance between both surfaces along the seam; None if they
        nowhere meet.
    photos_kept, photos_new : numbers of photos of the reference and of the rescan.
    stays : ids of holds that were not photographed or are of other colours; same : photographed and
        unchanged; gone : no more there; added : new.
    seam : lines along which replaced surface meets the rest, points in the scan's frame.
    colours : only holds of these colours were exchanged; empty: all (`sparse.part_colours`).
    missing : ids of holds of other colours that stay, although the photos do not show them.
    ignored : number of new holds that were not added, because of their colour or because a hold of
        another colour stays in their place.
    """

    replaced_share: float
    seam_mm: float | None
    photos_kept: int
    photos_new: int
    stays: tuple[Label, ...]
    same: tuple[Label, ...]
    gone: tuple[Label, ...]
    added: tuple[Label, ...]
    seam: tuple[tuple[Place, ...], ...] = ()
    colours: tuple[str, ...] = ()
    missing: tuple[Label, ...] = ()
    ignored: int = 0

    @property
    def summary(self) -> str:
        """Return one sentence for people."""
        off = self.seam_mm
        seam = "" if off is None else f"; 95 % of the seam is off by at most {off:.1f} mm"
        left, only = "not photographed", ""
        if self.colours:
            left = "not exchanged"
            only = (
                f"; only {', '.join(self.colours)}: {len(self.missing)} holds of other colours are "
                f"not on the photos and stay, {self.ignored} new holds ignored"
            )
        return (
            f"{100 * self.replaced_share:.0f} % of the wall replaced: {len(self.added)} holds new, "
            f"{len(self.gone)} gone, {len(self.same)} unchanged, {len(self.stays)} "
            f"{left}{seam}{only}"
        )


class Manifest(msgspec.Struct):
    """The manifest of one scan folder.

    Parameters
    ----------
    walltopo : version of the program that wrote it.
    settings : settings of the last run, by section and key.
    sources : where the photos came from.
    stages : stage name to its last run.
    joined : what a partial rescan replaced; None for other scans, and before it is joined. The
        stages before `edit` of a joined scan never run again.
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
