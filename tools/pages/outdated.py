"""Check that no figure of the README is older than the code that it speaks of.

    python -m tools.pages.outdated

A record names in `code` the files and folders whose changes may change its figures. Each record
that the README cites must name some. The command prints each record whose code has changed since it
was measured, and ends with exit code 1 if there is one. It needs the history: no shallow clone.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tools.pages.figures import LINK
from tools.pages.records import RESULTS, Record

ROOT = Path(__file__).parents[2]


def cited(page: Path) -> list[str]:
    """Return the names of the records that a page cites, in alphabetical order."""
    return sorted({found[2] for found in LINK.findall(page.read_text(encoding="utf-8"))})


def changes_since(root: Path, revision: str, code: tuple[str, ...]) -> list[str]:
    """Return the commits after `revision` that change `code`, newest first, one line each.

    Raises
    ------
    LookupError : the repository at `root` has no such commit.
    """
    command = ["git", "log", "--oneline", f"{revision.rstrip('+')}..HEAD", "--", *code]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    if done.returncode:
        raise LookupError(done.stderr.strip())
    return done.stdout.splitlines()


def outdated(root: Path) -> Iterator[str]:
    """Yield a sentence for each record that the README cites and whose code has changed since."""
    for name in cited(root / "README.md"):
        record = Record.load(root / RESULTS / f"{name}.json")
        if not record.code or record.measured is None:
            yield f"{name}.json: names no code that its figures depend on, or was not measured"
            continue
        for path in record.code:
            if not (root / path).exists():
                yield f"{name}.json: {path}: no such file or folder"
        try:
            commits = changes_since(root, record.measured.revision, record.code)
        except LookupError as error:
            yield f"{name}.json: {error}: fetch the whole history"
            continue
        if commits:
            yield (
                f"{name}.json: commits that changed its code after {record.measured.date}: "
                f"{len(commits)}, the last {commits[0]}. "
                f"Run `python -m tools.pages.records {name}` again."
            )


def main() -> int:
    """Print all sentences and return the exit code."""
    found = list(outdated(ROOT))
    for sentence in found:
        sys.stderr.write(f"{sentence}\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
