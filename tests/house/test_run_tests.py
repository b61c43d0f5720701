"""The runner of the tests: what it says of tests that fail once, twice, or often."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Fails in the first run alone.
ONCE = """
def test_{number}():
    seen = Path(__file__).with_suffix(".{number}")
    first = not seen.exists()
    seen.touch()
    assert not first, "the first time"
"""


def run(folder: Path, tests: str) -> subprocess.CompletedProcess[str]:
    """Run the tests of one file by the runner, in a folder of their own."""
    (folder / "run_tests.py").write_text((ROOT / "run_tests.py").read_text())
    (folder / "test_some.py").write_text(f"from pathlib import Path\n{tests}")
    (folder / "pytest.ini").write_text(
        "[pytest]\naddopts = -p no:cacheprovider\nmarkers =\n  slow: long\n"
    )
    words = [sys.executable, "run_tests.py", "quick", "--workers", "1"]
    plain = {name: value for name, value in os.environ.items() if "PYTEST" not in name}
    return subprocess.run(
        words, cwd=folder, env=plain, capture_output=True, text=True, check=False, timeout=300
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tests", "code", "line"),
    [
        ("def test_good(): pass", 0, ""),
        ("def test_bad(): assert 1 == 2, 'no'", 1, "FAILED twice test_some.py::test_bad"),
        (ONCE.format(number=1), 0, "FLAKY test_some.py::test_1: AssertionError: the first time"),
        ("".join(ONCE.format(number=n) for n in range(4)), 1, "4 flaky tests in one run"),
        ("".join(f"def test_{n}(): assert 0\n" for n in range(11)), 1, "11 failed"),
    ],
)
def test_the_verdict(tmp_path: Path, tests: str, code: int, line: str) -> None:
    done = run(tmp_path, tests)
    assert done.returncode == code, done.stdout + done.stderr
    assert line in done.stdout
