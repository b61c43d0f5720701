"""One unbroken way through the browser: an account, a gym, a wall, photos, review, what a climber sees.

    python -m gym.benchmarks.whole_way [--photos DIR] [--quick]

A server on an empty folder, and headless Chromium of a phone's size on the same machine
(`gym/web/tests/whole_way.mjs`). The server's own share is the time from pressing the button to the
review's table, less the seconds of the stages as the scan recorded them.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gym.tests.running import QUICK, Process
from gym.tests.worlds import PASSWORD

from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest

_ROOT = Path(__file__).resolve().parents[2]
_DEMO = _ROOT / "examples" / "demo-photos"
_PATIENCE_S = 7200


def walked(data: Path, photos: Path, quick: bool) -> list[dict[str, Any]]:
    """The parts of the way, as the browser reported them; the server's folder is `data`.

    Raises
    ------
    RuntimeError : the browser did not come to the end.
    """
    settings = {"new_gyms": "anyone"}
    if quick:
        (data / "quick.toml").write_text(QUICK)
        settings["scan_settings"] = str(data / "quick.toml")
    process = Process(data, "serve", "--port", "0", **settings)
    shots = Path(os.environ.get("WALLTOPO_SHOTS", data / "shots"))
    shots.mkdir(parents=True, exist_ok=True)
    places = {
        # Browsers keep the cookie of a sign-in over HTTPS and on this name only.
        "address": process.first_line.replace("127.0.0.1", "localhost"),
        "log": str(data / "serve.log"),
        "photos": str(photos.absolute()),
        "shots": str(shots),
        "password": PASSWORD,
    }
    (data / "places.json").write_text(json.dumps(places))
    try:
        ended = subprocess.run(
            ["node", "tests/whole_way.mjs", str(data / "places.json")],
            cwd=_ROOT / "gym/web",
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            check=False,
        )
    finally:
        process.stop()
    parts = [json.loads(line) for line in ended.stdout.splitlines()]
    if ended.returncode:
        done = ", ".join(part["name"] for part in parts)
        raise RuntimeError(f"after {done or 'nothing'}: {ended.stderr[-3000:]}")
    return parts


def stage_seconds(data: Path) -> float:
    """The seconds of all stages of the one scan."""
    (folder,) = (data / "files" / "scans").iterdir()
    stages = Manifest.load(ScanFolder(folder).manifest).stages.values()
    return sum(stage.seconds for stage in stages)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--photos", type=Path, default=_DEMO, help="default: the demo's")
    parser.add_argument("--quick", action="store_true", help="with the quick settings of the tests")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        data = Path(name)
        parts = walked(data, args.photos, args.quick)
        itself = stage_seconds(data)
    refused = parts.pop()
    for part in parts:
        note = f" ({part['result']})" if part.get("result") else ""
        print(f"{part['name']}{note}: {part['seconds']:.1f} s")
    scan = next(part["seconds"] for part in parts if part["name"] == "scan")
    print(f"{refused['name']}: {refused['result']}")
    print(f"stages of the scan: {itself:.1f} s; the server adds: {scan - itself:.1f} s")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
