"""The shortest look at the viewer in a real browser: a wall opens, and a tap lights a route."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from made_scan import build_scan, export_scan  # type: ignore[import-not-found]
from test_viewer_browser import SMALL, VIEWER, missing  # type: ignore[import-not-found]


def test_a_wall_opens_and_a_tap_lights_its_route(
    tmp_path: Path, lacks: Callable[[str], NoReturn]
) -> None:
    if missing():
        lacks(missing())
    scan = build_scan(tmp_path / "scan")
    export_scan(scan, SMALL)
    listing = tmp_path / "places.json"
    listing.write_text(json.dumps({"disk": scan.page.as_uri(), "shots": str(tmp_path)}))
    done = subprocess.run(
        [
            "node_modules/.bin/playwright",
            "test",
            "--grep",
            "opens from disk|a tap on a hold",
            f"--output={tmp_path / 'out'}",
        ],
        cwd=VIEWER,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
        env={**os.environ, "WALLTOPO_PLACES": str(listing)},
    )
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]
    assert "2 passed" in done.stdout
