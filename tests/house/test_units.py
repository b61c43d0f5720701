"""The tests of a unit need no unit above it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Tests, and the units that they may not import.
ABOVE = {
    "tests": {"walltopo_climb", "walltopo_lab", "walltopo_gym"},
    "climb/tests": {"walltopo_lab", "walltopo_gym"},
    "lab/tests": {"walltopo_gym"},
}


def _imported(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module or ""


@pytest.mark.parametrize("folder", ABOVE)
def test_tests_import_no_unit_above(folder: str) -> None:
    files = list((ROOT / folder).rglob("*.py"))
    assert len(files) > 5
    found = {
        (str(file.relative_to(ROOT)), name)
        for file in files
        for name in _imported(file)
        if name.split(".")[0] in ABOVE[folder]
    }
    assert found == set()
