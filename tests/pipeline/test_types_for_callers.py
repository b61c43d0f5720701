"""Callers see the types of the functions that `import walltopo` loads lazily."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Each line with the code of the error that mypy must tell there; "" for none.
LINES = (
    ("import walltopo", ""),
    ('done = walltopo.scan("photos", "out")', ""),
    ("done.metrics", ""),
    ('walltopo.scan(3, "out")', "arg-type"),
    ('walltopo.scan("photos", "out", to_stages="lift")', "call-arg"),
    ("done.metric", "attr-defined"),
    ('mesh = walltopo.read_mesh(__import__("pathlib").Path("mesh.ply"))', ""),
    ("walltopo.lift(mesh, (), walltopo.LiftParams())", ""),
    ('walltopo.lift("mesh.ply", (), walltopo.LiftParams())', "arg-type"),
    ("walltopo.lift(mesh, (), {})", "arg-type"),
    ('walltopo.LiftParams(threshold="half")', "arg-type"),
)


@pytest.mark.slow
def test_mypy_sees_wrong_arguments_at_the_caller(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    snippet = tmp_path / "caller.py"
    snippet.write_text("".join(f"{line}\n" for line, _ in LINES))
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-error-summary", str(snippet)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=570,
    )
    output = {
        (int(row.split(":")[1]), row.rpartition("[")[2].rstrip("]"))
        for row in done.stdout.splitlines()
        # A second run may show the path of the first one, from mypy's cache.
        if f"/{snippet.name}:" in row and ": error:" in row
    }
    expected = {(number, code) for number, (_, code) in enumerate(LINES, start=1) if code}
    assert output == expected, done.stdout + done.stderr
