"""How soon the app is there on a slow phone, and what Lighthouse says of its pages.

    python -m gym.benchmarks.phone [--demo demo-gym] [--turns 5]

The demo gym (`walltopo gym demo`, made first where the folder has none) in headless Chromium of a
phone's size, whose processor is slowed four times, behind a line of 9 Mbit/s and 60 ms
(`gym/web/tests/phone.mjs`, `line.mjs`); server and browser on this one machine. Each figure is the
median of the turns and the worst of them; a first visit has nothing kept. Interactive: the list of
walls is drawn, and no long task (50 ms) comes any more. A wall is there when its first tier has
been handed to the graphics; headless Chromium has no graphics processor, so the processor draws it,
which no phone does: that moment is listed separately. Lighthouse is put into `gym/web/build` by
npm at the first run; nothing else uses it.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gym.tests.running import Process
from sqlalchemy import select

from walltopo.core.parallel import available_cores
from walltopo_gym.cli.gym_data import database_of
from walltopo_gym.demo.hall import SLUG
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route
from walltopo_gym.settings import load_settings
from walltopo_gym.walls.models import Wall

_ROOT = Path(__file__).resolve().parents[2]
_WEB = _ROOT / "gym/web"
_PHOTOS = _ROOT / "examples/demo-photos"
_LIGHTHOUSE = "lighthouse@12.8.2"  # the last one for Node 20
_PATIENCE_S = 1800
_SECONDS = {
    "gym, seen": "walls seen",
    "gym, interactive": "interactive",
    "wall, first visit": "first visit",
    "wall, first visit, drawn": "first visit, drawn by the processor",
    "wall, second visit": "second visit",
    "wall, second visit, drawn": "second visit, drawn by the processor",
}


def lighthouse() -> Path:
    """The command, installed if it is not there."""
    folder = _WEB / "build/lighthouse"
    command = folder / "node_modules/lighthouse/cli/index.js"
    if not command.is_file():
        words = ["install", "--prefix", str(folder), "--no-audit", "--no-fund", "--silent"]
        subprocess.run(["npm", *words, _LIGHTHOUSE], check=True)
    return command


def demo(data: Path) -> dict[str, str]:
    """Make the demo gym where it is missing; what the browser has to know of it."""
    words = ["--data", str(data), "--photos", str(_PHOTOS), "--no-serve"]
    subprocess.run(
        [sys.executable, "-m", "walltopo", "gym", "demo", *words],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    with database_of(load_settings({"data": data})) as database, database.reading() as session:
        wall = session.scalars(select(Wall).join(Gym).where(Gym.slug == SLUG)).one()
        route = session.scalars(select(Route.id).where(Route.wall_id == wall.id)).first()
    email = f"climber@{SLUG}.example"
    return {
        "gym": SLUG,
        "wall": str(wall.id),
        "scan": str(wall.published_scan_id),
        "route": str(route),
        "climber": email,
        "password": json.loads((data / "demo-accounts.json").read_text())[email],
    }


def ports(number: int) -> list[int]:
    """So many that are free."""
    probes = [socket.create_server(("127.0.0.1", 0)) for _ in range(number)]
    found = [int(probe.getsockname()[1]) for probe in probes]
    for probe in probes:
        probe.close()
    return found


def driven(data: Path, turns: int) -> Iterator[tuple[str, Any]]:
    """Names and values, as the browser tells them.

    Raises
    ------
    RuntimeError : the browser did not come to the end.
    """
    known = demo(data)
    front, back, debugging = ports(3)
    # Browsers keep the cookie of a sign-in over HTTPS and on this name only.
    address = f"http://localhost:{front}"
    gym = f"/g/{known['gym']}"
    wall = f"{gym}/w/{known['wall']}"
    pages = {
        "public": ["/", "/sign-in", gym, wall, f"{wall}/r/{known['route']}"],
        "own": [gym, f"{wall}/r/{known['route']}", f"{gym}/progress", f"{gym}/board", "/me"],
    }
    facts = (
        known
        | pages
        | {
            "address": address,
            "port": front,
            "target": back,
            "debugging": debugging,
            "turns": turns,
            "lighthouse": str(lighthouse()),
        }
    )
    places = data / "places.json"
    places.write_text(json.dumps(facts))
    places.chmod(0o600)
    settings = {"workers": "0", "requests_per_minute": "0", "address": address}
    process = Process(data, "serve", "--port", str(back), **settings)
    try:
        ended = subprocess.run(
            ["node", "tests/phone.mjs", str(places)],
            cwd=_WEB,
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            check=False,
        )
    finally:
        process.stop()
        places.unlink()
    if ended.returncode:
        raise RuntimeError(ended.stderr[-3000:])
    for text in ended.stdout.splitlines():
        row = json.loads(text)
        # Ids mean nothing to readers of the record.
        name = row["name"].replace(known["wall"], "WALL").replace(known["route"], "ROUTE")
        yield name, row["value"]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--demo", type=Path, default=Path("demo-gym"), help="its data folder")
    parser.add_argument("--turns", type=int, default=5)
    args = parser.parse_args(arguments)
    found: dict[str, list[Any]] = defaultdict(list)
    for name, value in driven(args.demo.absolute(), args.turns):
        found[name].append(value)
    print(f"{args.turns} turns, {available_cores()} cores, load {os.getloadavg()[0]:.1f}")
    print(f"JavaScript of the gym's page without the viewer: {max(found.pop('JavaScript')):.1f} kB")
    for name, label in _SECONDS.items():
        values = np.array(found.pop(name)) / 1000
        place = "gym's page" if name.startswith("gym") else "first tier of the wall"
        print(f"{place}, {label}: {np.median(values):.2f} s, at worst {values.max():.2f} s")
    (against,) = found.pop("against installing")
    print(f"installable: {'no: ' + ', '.join(against) if against else 'yes'}")
    for page, (scores,) in found.items():
        words = [f"{kind} {one['score']}" for kind, one in scores.items()]
        wanting = [name for one in scores.values() for name in one["wanting"]]
        print(f"{page}: {', '.join(words)}{' (' + ', '.join(wanting) + ')' if wanting else ''}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
