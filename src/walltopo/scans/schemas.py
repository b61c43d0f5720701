"""JSON Schemas of what a scan folder holds, for other programs.

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
from walltopo.scans.attributes import Attributes
from walltopo.scans.detections import CocoFile
from walltopo.scans.edits import EditLog
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords
from walltopo.scans.manifest import Manifest
from walltopo.scans.moves import Moves
from walltopo.scans.photos import PhotoList
from walltopo.scans.pictures import CutoutIndex
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Scale
from walltopo.scans.sources import SourceList

# File of the scan folder to its type.
SCHEMAS: dict[str, type[msgspec.Struct]] = {
    "scan.json": Manifest,
    "photos.json": PhotoList,
    "scale.json": Scale,
    "detections.json": CocoFile,
    "instances.json": InstanceRecords,
    "attributes.json": Attributes,
    "cutouts/index.json": CutoutIndex,
    "routes.json": Routes,
    "holds.json": Holds,
    "moves.json": Moves,
    "edits.json": EditLog,
    "sources.json": SourceList,
}


def schema_name(file: str) -> str:
    """The schema's file for a file of the scan folder."""
    stem = file.rpartition(".")[0].replace("/", "-").replace("-index", "")
    return f"{stem}.schema.json"


def schema_text(file: str) -> str:
    """The schema of a file of the scan folder (JSON Schema 2020-12)."""
    schema: dict[str, Any] = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **_dedented(msgspec.json.schema(SCHEMAS[file])),
    }
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def _dedented(schema: Any) -> Any:
    """The same with docstrings that do not depend on the Python that read them."""
    if isinstance(schema, list):
        return [_dedented(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        key: inspect.cleandoc(item)
        if key == "description" and isinstance(item, str)
        else _dedented(item)
        for key, item in schema.items()
    }


def _write(folder: Path) -> None:
    for file in SCHEMAS:
        with atomic_path(folder / schema_name(file)) as temporary:
            temporary.write_text(schema_text(file), encoding="utf-8")


if __name__ == "__main__":
    _write(Path(sys.argv[1]))
