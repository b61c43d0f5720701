"""Corrections in a program: name a route, take a hold out, make page and tables anew.

python examples/correct_and_export.py SCAN

The log of corrections is a file like any other (docs/edits.md); the next scan keeps it.
"""

from __future__ import annotations

import sys
from pathlib import Path

from walltopo.pipeline.runner import refresh
from walltopo.scans.edits import EditLog, Ref, Remove, SetRoute
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.routes import Routes


def main(scan: Path) -> None:
    log = EditLog.load(scan / "edits.json") if (scan / "edits.json").exists() else EditLog()
    route = Routes.load(scan / "routes.json").routes[0]
    holds = {hold.id: hold for hold in Holds.load(scan / "holds.json").holds}
    first = holds[route.holds[0]]
    # A hold is named by its id and its place: ids change from scan to scan, places hardly do.
    weakest = min(holds.values(), key=lambda hold: hold.score)
    edits = (
        SetRoute(route=Ref(route.id, first.position), name="The Owl", grade="6b"),
        Remove(hold=Ref(weakest.id, weakest.position)),
    )
    EditLog(edits=(*log.edits, *edits)).save(scan / "edits.json")
    # Only what follows from the corrections is done again, with the settings of the scan.
    print("computed now:", ", ".join(refresh(ScanFolder(scan), ("edit", "export"))))
    names = [route.name for route in Routes.load(scan / "routes.json").routes]
    print("routes:", ", ".join(names), "| holds:", len(Holds.load(scan / "holds.json").holds))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python examples/correct_and_export.py SCAN")
    main(Path(sys.argv[1]))
