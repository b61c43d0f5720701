"""The viewer's types: schemas in TypeScript, and files that are older than their source."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from viewer import wire_types


def test_each_kind_of_value_has_its_type() -> None:
    number, text = {"type": "integer"}, {"type": "string"}
    schema = {
        "$defs": {
            "Place": {
                "description": "A place.\n\nParameters\n----------\nx : metres.",
                "properties": {
                    "x": {"type": "number"},
                    "of": {"anyOf": [{"$ref": "#/$defs/Other"}, {"type": "null"}]},
                    "kind": {"enum": ["a", "b"]},
                    "pair": {"type": "array", "prefixItems": [number, text], "items": False},
                    "many": {"type": "array", "items": {"anyOf": [number, text]}},
                    "by": {"type": "object", "additionalProperties": number},
                },
                "required": ["x", "of"],
            }
        }
    }
    made = wire_types.typescript(json.dumps(schema))
    assert made.endswith(
        """/** A place. */
export interface Place {
  x: number;
  of: Other | null;
  kind?: "a" | "b";
  pair?: [number, string];
  many?: (number | string)[];
  by?: Record<string, number>;
}
"""
    )


def test_a_file_that_somebody_changed_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "docs").mkdir()
    monkeypatch.setattr(wire_types, "ROOT", tmp_path)
    monkeypatch.setattr(wire_types, "SCHEMA", tmp_path / "docs" / "viewer.schema.json")
    monkeypatch.setattr(wire_types, "TYPES", tmp_path / "wire.ts")
    assert len(list(wire_types.complaints())) == 2
    wire_types.write()
    assert list(wire_types.complaints()) == []
    types = (tmp_path / "wire.ts").read_text()
    (tmp_path / "wire.ts").write_text(types.replace("radius_m: number", "radius_m: string"))
    assert [line.split(":")[0] for line in wire_types.complaints()] == ["wire.ts"]
