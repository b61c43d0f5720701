"""Make a scan and a gym with an older walltopo, and open both with this one.

    python -m tools.upgrade_check [REVISION]

REVISION is a tag or commit of this repository; by default the last release's tag, or, before the
first, `FIRST`. The older code runs from its own files, with the dependencies that are installed.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import sqlite3
import subprocess
import sys
import tarfile
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Final

from rich.console import Console

ROOT: Final = Path(__file__).parents[1]
# The last commit before migration 0002, with the tables of the first one.
FIRST: Final = "25cbf3be"
_PHOTOS: Final = ROOT / "tests" / "data" / "tiny-gym"
_SETTINGS: Final = ("--set", "sparse.threads=1", "--set", "texture.size=512")

console = Console(highlight=False, soft_wrap=True)


class Walltopo:
    """The walltopo of a source tree, run with this Python."""

    def __init__(self, tree: Path) -> None:
        parts = (tree / "src", *tree.glob("*/src"))
        self._environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, parts))}

    def run(self, *arguments: str | Path, accepted: tuple[int, ...] = (0,)) -> str:
        """Run a command of walltopo; return its output and raise as `run_python`."""
        return self.run_python("-m", "walltopo", *arguments, accepted=accepted)

    def run_python(self, *arguments: str | Path, accepted: tuple[int, ...] = (0,)) -> str:
        """Run Python with the modules of the tree; return its output.

        Raises
        ------
        SystemExit : the exit code is not accepted.
        """
        done = subprocess.run(
            [sys.executable, *arguments],
            env=self._environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode not in accepted:
            words = " ".join(map(str, arguments))
            raise SystemExit(
                f"python {words}: exit code {done.returncode}\n{done.stdout}{done.stderr}"
            )
        return done.stdout

    @contextmanager
    def serve(self, *arguments: str | Path) -> Iterator[str]:
        """Serve during the block; yield the address that the server prints.

        Raises
        ------
        SystemExit : the server ends before it names an address.
        """
        server = subprocess.Popen(
            [sys.executable, "-m", "walltopo", *arguments],
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert server.stdout is not None
        shown = ""
        try:
            for line in server.stdout:
                shown += line
                if found := re.search(r"http://[^\s\"]+", line):
                    yield found[0].rstrip(".,")
                    return
            raise SystemExit(f"walltopo {arguments[0]} {arguments[1]} ended:\n{shown}")
        finally:
            server.terminate()
            server.communicate()


def last_release() -> str:
    """Return the tag of the last release before this commit; `FIRST` without one."""
    command = ["git", "-C", str(ROOT), "describe", "--tags", "--abbrev=0", "--match=v*", "HEAD^"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else FIRST


def unpack(revision: str, folder: Path) -> Walltopo:
    """Write the files of a revision into a folder; return its walltopo."""
    command = ["git", "-C", str(ROOT), "archive", revision]
    packed = subprocess.run(command, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=BytesIO(packed)) as archive:
        archive.extractall(folder)
    return Walltopo(folder)


def rows(database: Path) -> dict[str, int]:
    """Return the number of rows of each table."""
    connection = sqlite3.connect(f"file:{database}?mode=ro", uri=True)
    try:
        query = "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'"
        names = [name for (name,) in connection.execute(query)]
        return {n: connection.execute(f'SELECT count(*) FROM "{n}"').fetchone()[0] for n in names}
    finally:
        connection.close()


def files(folder: Path) -> set[str]:
    """Return the paths of all files below a folder."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def check_scan(new: Walltopo, scan: Path) -> None:
    """Read and serve a scan that the older version made, then bring it up to date."""
    new.run("status", scan, accepted=(0, 1))  # 1: some stages would run again
    with new.serve("view", scan, "--port", "0") as address:
        page = urllib.request.urlopen(address).read().decode()
        if "<wall-topo" not in page:
            raise SystemExit(f"{scan}: its page has no wall")
    console.print("scan: read and shown as it is")
    new.run("scan", _PHOTOS, "-o", scan, *_SETTINGS)
    new.run("status", scan)
    console.print("scan: up to date")


def check_gym(new: Walltopo, data: Path) -> None:
    """Migrate and serve a gym; no row of a table and no file may get lost."""
    (database,) = data.glob("*.sqlite")
    before, stored = rows(database), files(data / "files")
    new.run("gym", "migrate", "--data", data)
    after = rows(database)
    if lost := {name: count for name, count in before.items() if after.get(name, 0) < count}:
        raise SystemExit(f"{data}: the migration lost rows of {', '.join(sorted(lost))}")
    if gone := stored - files(data / "files"):
        raise SystemExit(f"{data}: the migration lost the files {', '.join(sorted(gone)[:10])}")
    new.run("gym", "doctor", "--data", data)
    with new.serve("gym", "serve", "--data", data, "--port", "0") as address:
        for path in ("/ready", "/api/v1/gyms/demo"):
            with urllib.request.urlopen(address + path) as answer:
                assert answer.status == 200
    console.print(
        f"gym: {sum(before.values()):,} rows of {len(before)} tables and "
        f"{len(stored):,} files kept, served"
    )


def main() -> int:
    """Check the upgrade; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("revision", nargs="?", default=last_release(), metavar="REVISION")
    revision = parser.parse_args().revision
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        old, new = unpack(revision, folder / "old"), Walltopo(ROOT)
        old.run("scan", _PHOTOS, "-o", folder / "scan", *_SETTINGS)
        old.run("gym", "demo", "--photos", _PHOTOS, "--no-serve", "--data", folder / "gym")
        version = (folder / "old" / "VERSION").read_text(encoding="utf-8").strip()
        console.print(f"made with {version} ({revision}) in {time.monotonic() - began:.0f} s")
        shutil.rmtree(folder / "old")
        check_scan(new, folder / "scan")
        check_gym(new, folder / "gym")
    return 0


if __name__ == "__main__":
    sys.exit(main())
