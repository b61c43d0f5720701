"""Write JSON Schemas of the files of a scan folder, for other programs.

    python -m walltopo.scans.schemas DIR

writes `docs/schemas/` (as `make docs` does).
"""

from __future__ import annotations

import inspect
import json
import sys
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core.files import atomic_path
from walltopo.scans.attempt import AttemptFile
from walltopo.scans.detections import CocoFile
from walltopo.scans.edits import EditLog
from walltopo.scans.hidden import HiddenPlaces
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords
from walltopo.scans.joined import Joined
from walltopo.scans.manifest import Manifest
from walltopo.scans.moves import Moves
from walltopo.scans.page_labels import PageLabels
from walltopo.scans.people import PeopleList
from walltopo.scans.photos import PhotoList, SourceList
from walltopo.scans.pictures import CutoutIndex
from walltopo.scans.poses import GivenPoses
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Scale

# File of the scan folder to its type.
SCHEMAS: dict[str, type[msgspec.Struct]] = {
    "scan.json": Manifest,
    "photos.json": PhotoList,
    "photos/people.json": PeopleList,
    "scale.json": Scale,
    "detections.json": CocoFile,
    "instances.json": InstanceRecords,
    "cutouts/index.json": CutoutIndex,
    "routes.json": Routes,
    "holds.json": Holds,
    "moves.json": Moves,
    "attempt.json": AttemptFile,
    "page/labels.json": PageLabels,
    "joined.json": Joined,
    "hidden.json": HiddenPlaces,
    "edits.json": EditLog,
    "sources.json": SourceList,
    "poses.json": GivenPoses,
}


def schema_name(file: str) -> str:
    """Return the name of the schema for a file of the scan folder."""
    stem = file.rpartition(".")[0].replace("/", "-").replace("-index", "")
    return f"{stem}.schema.json"


def schema_text(file: str) -> str:
    """Return the schema of a file of the scan folder (JSON Schema 2020-12)."""
    schema: dict[str, Any] = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **dedent_schema(msgspec.json.schema(SCHEMAS[file])),
    }
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def dedent_schema(schema: Any) -> Any:
    """Return a schema whose docstrings do not depend on the Python version."""
    if isinstance(schema, list):
        return [dedent_schema(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        key: inspect.cleandoc(item)
        if key == "description" and isinstance(item, str)
        else dedent_schema(item)
        for key, item in schema.items()
    }


def _write(folder: Path) -> None:
    for file in SCHEMAS:
        with atomic_path(folder / schema_name(file)) as temporary:
            temporary.write_text(schema_text(file), encoding="utf-8")


if __name__ == "__main__":
    _write(Path(sys.argv[1]))
