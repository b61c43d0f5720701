"""Write docs/bad-input.md: what `walltopo` and the platform answer to every case (`make docs`)."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from tools.tests.bad_input.cases import CASES, Case
from tools.tests.bad_input.platform_cases import PLATFORM_CASES, answer_of

HEAD = """\
# What happens with bad input

Written by `make docs` from `tools/tests/bad_input`; the tests run every row. Exit codes:
0 done, 2 usage or settings, 3 the input, 4 no result from usable input, 5 the machine.

| given | exit | output |
|---|---|---|
"""

PLATFORM_HEAD = """\

## The platform

Each row has a test of the platform (`platform_cases.py` names it).

| given | answer |
|---|---|
"""


def shown_output(output: str, root: Path) -> str:
    """Return the significant lines of an output, without this machine's folders."""
    text = output.replace(str(root), "").replace("/in/", "in/")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if lines and lines[0].startswith("usage:"):
        lines = lines[-1:]
    lines = [line for line in lines if not line.startswith("✗") and "(estimate)" not in line]
    lines = [re.sub(r"\s+[\d.]+ s$", "", line) for line in lines]
    # Keep the error, and at most one line of output before it.
    error = next((k for k, line in enumerate(lines) if line.startswith("error:")), 0)
    return " / ".join(lines[max(0, error - 1) :][:3]).replace("|", "\\|")


def row(case: Case) -> str:
    """Return the table row of one case."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        command = [sys.executable, "-m", "walltopo", *case.make(root)]
        done = subprocess.run(command, capture_output=True, text=True)
        shown = shown_output(done.stdout + done.stderr, root)
        return f"| {case.name} | {done.returncode} | {shown} |"


def platform_part() -> str:
    """Return the page's part on the platform."""
    rows = (f"| {case.given} | {answer_of(case)} |" for case in PLATFORM_CASES)
    return PLATFORM_HEAD + "\n".join(rows) + "\n"


def main() -> None:
    sys.stdout.write(HEAD + "\n".join(row(case) for case in CASES) + "\n" + platform_part())


if __name__ == "__main__":
    main()
