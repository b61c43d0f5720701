"""Time of one saved edit, and what it rewrites: `python -m benchmarks.edit_time SCAN`.

Copies a finished scan, opens an edit session on it and saves four edits in sequence, each as
`walltopo view --edit` does. For each: seconds until the preview is ready, its size as JSON, seconds
from the save until all files show the edit, bytes written below `page/`, and bytes written in all
files, `wall.glb` included.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

import msgspec

from walltopo.core.files import files_below
from walltopo.pipeline.edit_session import open_session
from walltopo.scans.edits import Edit, EditLog, Join, Paint, Ref, Remove, SetRoute
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds

BRUSH = 0.05  # metres


def edits_of(scan: ScanFolder) -> dict[str, Edit]:
    """Return one edit of each kind, on holds that are far apart in the scan's list."""
    rows = [row for row in Holds.load(scan.holds).holds if row.kind == "hold"]

    def ref(row: Hold) -> Ref:
        return Ref(row.id, row.position)

    painted = rows[len(rows) // 4]
    x, y, z = painted.position
    route = next(row.route for row in rows if row.route)
    return {
        "name a route": SetRoute(route=Ref(route), name="Owl"),
        "not a hold": Remove(hold=ref(rows[len(rows) // 2])),
        "brush, 5 cm": Paint(hold=ref(painted), at=(x, y, z + 0.1), radius_m=BRUSH),
        "join two": Join(holds=(ref(rows[0]), ref(rows[1]))),
    }


def _written(root: Path, since: dict[Path, tuple[int, int]]) -> list[Path]:
    """Return the files that differ from those of `since`; a link to a kept file does not count."""
    return [path for path, stamp in _file_stamps(root).items() if since.get(path) != stamp]


def _file_stamps(root: Path) -> dict[Path, tuple[int, int]]:
    """Return inode and modification time (ns) of each file below a folder."""
    found = {path: path.stat() for path in files_below(root)}
    return {path: (stat.st_ino, stat.st_mtime_ns) for path, stat in found.items()}


def measure(root: Path) -> None:
    """Save the edits on a scan and print a row for each."""
    scan = ScanFolder(root)
    scan.page.unlink()  # force the first rebuild to write everything
    session = open_session(scan)
    began = time.monotonic()
    session.rebuild()
    session.close()
    print(f"{len(ScanFolder.mesh.load(scan).faces):,} triangles")
    print(f"first rebuild: {time.monotonic() - began:.1f} s")
    print("| edit | preview s | preview kB | files s | page kB written | all MB written |")
    print("|---|---|---|---|---|---|")
    entries: tuple[Edit, ...] = ()
    session.preview(EditLog(edits=entries))
    for name, edit in edits_of(scan).items():
        entries = (*entries, edit)
        log, before = EditLog(edits=entries), _file_stamps(root)
        began = time.monotonic()
        result = session.preview(log)
        seen = time.monotonic() - began
        size = len(msgspec.json.encode(result))
        began = time.monotonic()
        session.save(log, session.read()[1])
        session.close()
        took = time.monotonic() - began
        if session.status().problem:
            sys.exit(session.status().problem)
        written = _written(root, before)
        page = sum(path.stat().st_size for path in written if path.is_relative_to(root / "page"))
        every = sum(path.stat().st_size for path in written)
        print(
            f"| {name} | {seen:.2f} | {size / 1e3:.0f} | {took:.1f} | {page / 1e3:.0f}"
            f" | {every / 1e6:.1f} |",
            flush=True,
        )


def main() -> None:
    """Run the command line."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "scan"
        shutil.copytree(sys.argv[1], copy)
        measure(copy)


if __name__ == "__main__":
    main()
