"""The web app in a real browser, on a server with a wall in review: `gym/web/tests`."""

from __future__ import annotations

import os
import subprocess
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest
from gym.tests.web.places import WEB, free_port, missing_browser, new_world, serving
from gym.tests.worlds import Server, make_world

from walltopo.scans.folder import ScanFolder
from walltopo.scans.routes import Routes
from walltopo_gym.hall.secrets import unsubscribe_token

pytestmark = pytest.mark.slow

# While you write a test: WALLTOPO_FLOWS="forms account" runs these files alone.
ONLY = [f"--project={name}" for name in os.environ.get("WALLTOPO_FLOWS", "").split()]


def test_the_app(
    tmp_path: Path, tiny_photos: Path, tiny_scan: Path, lacks: Callable[[str], NoReturn]
) -> None:
    if missing_browser():
        lacks(missing_browser())
    world = new_world(tmp_path / "app")
    member = world.people["member"].id
    assert member is not None
    places = {
        "photos": str(tiny_photos),
        "scan": str(world.finished(tiny_scan)),
        "later": str(world.finished(tiny_scan)),
        "mails_link": unsubscribe_token(world.server.database, member),
        "bare": _bare_wall(world.server, tiny_scan),
    }
    # Browsers keep the cookie of a sign-in over HTTPS and on this name only; a passkey is for the
    # server's own address.
    port = free_port()
    with serving(world, port, f"http://localhost:{port}", places) as environment:
        done = subprocess.run(
            ["node_modules/.bin/playwright", "test", *ONLY],
            cwd=WEB, capture_output=True, text=True, timeout=2700, check=False, env=environment,
        )  # fmt: skip
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]


def _bare_wall(server: Server, folder: Path) -> dict[str, str]:
    """Make a gym whose wall has no published scan but one in review; return what its test needs."""
    world = make_world(server, visibility="unlisted")
    scan = world.finished(folder)
    colours = Counter(route.colour for route in Routes.load(ScanFolder(folder).routes).routes)
    colour = next(name for name, number in colours.items() if number == 1)
    return {
        "gym": world.gym.slug,
        "wall": str(world.wall.id),
        "scan": str(scan),
        "colour": colour,
        "setter": world.people["setter"].email,
        "member": world.people["member"].email,
    }
