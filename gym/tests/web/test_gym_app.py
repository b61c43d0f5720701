"""The web app in a real browser, on a server with a wall in review: `gym/web/tests`."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest
from gym.tests.running import QUICK, Process
from gym.tests.worlds import PASSWORD, Server, make_world

from walltopo_gym.hall.secrets import unsubscribe_token

ROOT = Path(__file__).resolve().parents[3]
WEB = ROOT / "gym" / "web"
CHECKS = (
    "forms", "setting", "publishing", "progress", "insights", "climbing", "competitions", "account",
    "hall",
)  # fmt: skip
NAMES = [
    name
    for check in CHECKS
    for name in re.findall(
        r'^  async "(.+?)"\(', (WEB / "tests" / f"{check}.mjs").read_text(), re.M
    )
]
SHOTS = Path(os.environ.get("WALLTOPO_SHOTS", ROOT / "build" / "gym-shots"))

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def outcome(
    tmp_path_factory: pytest.TempPathFactory, tiny_photos: Path, tiny_scan: Path,
    lacks: Callable[[str], NoReturn],
) -> dict[str, str]:  # fmt: skip
    """What each check came to; empty where all is well."""
    chromium = os.environ.get("WALLTOPO_CHROMIUM", "/usr/bin/chromium")
    if not Path(chromium).exists() or not (ROOT / "viewer/node_modules/playwright-core").is_dir():
        lacks("no browser, or viewer/node_modules is missing (make browser)")
    data = tmp_path_factory.mktemp("app")
    (data / "quick.toml").write_text(QUICK)
    world = make_world(Server(data), visibility="public")
    scan, later = world.finished(tiny_scan), world.finished(tiny_scan)
    member = world.people["member"].id
    assert member is not None
    mails_link = unsubscribe_token(world.server.database, member)
    world.server.close()
    # Browsers keep the cookie of a sign-in over HTTPS and on this name only; a passkey is for the
    # server's own address.
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    address = f"http://localhost:{port}"
    settings = {"scan_settings": str(data / "quick.toml"), "new_gyms": "anyone"}
    process = Process(data, "serve", "--port", port, address=address, **settings)
    SHOTS.mkdir(parents=True, exist_ok=True)
    places = {
        "address": address,
        "log": str(data / "serve.log"),
        "photos": str(tiny_photos),
        "shots": str(SHOTS),
        "password": PASSWORD,
        "gym": world.gym.slug,
        "wall": str(world.wall.id),
        "scan": str(scan),
        "later": str(later),
        "mails_link": mails_link,
    } | {role: who.email for role, who in world.people.items()}
    (data / "places.json").write_text(json.dumps(places))
    try:
        done = subprocess.run(
            ["node", "tests/run.mjs", str(data / "places.json")],
            cwd=WEB, capture_output=True, text=True, timeout=1800, check=False,
        )  # fmt: skip
    finally:
        process.stop()
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    assert lines, f"the browser did not start: {done.stderr[-2000:]}"
    return {line["name"]: line["problem"] for line in lines}


@pytest.mark.parametrize("name", NAMES)
def test_the_app(outcome: dict[str, str], name: str) -> None:
    assert outcome[name] == ""
