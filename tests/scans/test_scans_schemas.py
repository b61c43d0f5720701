"""The published JSON Schemas: current, and true of what is written."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from any_value import any_of  # type: ignore[import-not-found]
from hypothesis import given, settings
from jsonschema import Draft202012Validator, ValidationError

from walltopo.scans.detections import CocoFile
from walltopo.scans.schemas import SCHEMAS, schema_name

DOCS = Path(__file__).resolve().parents[2] / "docs"
SAVED = [file for file, kind in SCHEMAS.items() if kind is not CocoFile]


def validator(file: str) -> Draft202012Validator:
    schema = json.loads((DOCS / "schemas" / schema_name(file)).read_text(encoding="utf-8"))
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def read(path: Path) -> Any:
    text = path.read_text(encoding="utf-8")
    return tomllib.loads(text) if path.suffix == ".toml" else json.loads(text)


@pytest.mark.parametrize("file", SAVED)
def test_whatever_is_saved_is_valid(file: str, tmp_path: Path) -> None:
    check_schema = validator(file)

    @settings(max_examples=25)
    @given(any_of(SCHEMAS[file]))
    def check(value: Any) -> None:
        path = tmp_path / Path(file).name
        value.save(path)
        check_schema.validate(read(path))

    check()


@pytest.mark.parametrize("file", SCHEMAS)
def test_something_else_is_not_valid(file: str) -> None:
    values: list[Any] = [[], 3, {"version": "one", "images": 3}]
    for value in values:
        with pytest.raises(ValidationError):
            validator(file).validate(value)


@pytest.mark.slow
def test_what_a_scan_writes_is_valid(tiny_scan: Path) -> None:
    # Written by a command of its own, only by a partial rescan, only if a photo shows people, only
    # with poses of a phone.
    requested = {"attempt.json", "joined.json", "moves.json", "photos/people.json", "poses.json"}
    written = [file for file in SCHEMAS if "edits" not in file and file not in requested]
    for file in written:
        validator(file).validate(read(tiny_scan / file))
