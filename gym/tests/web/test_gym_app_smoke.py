"""The shortest way through the web app in a real browser: `gym/web/tests/smoke`."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from gym.tests.postgres import free_port
from gym.tests.web.places import WEB, missing_browser, new_world, publish_wall, serving


def test_a_climber_ticks_a_route(
    tmp_path: Path, tiny_scan: Path, lacks: Callable[[str], NoReturn]
) -> None:
    if missing_browser():
        lacks(missing_browser())
    world = new_world(tmp_path / "app")
    publish_wall(world, tiny_scan)
    port = free_port()
    with serving(world, port, f"http://localhost:{port}", {}) as environment:
        done = subprocess.run(
            ["node_modules/.bin/playwright", "test", "-c", "tests/smoke"],
            cwd=WEB, capture_output=True, text=True, timeout=900, check=False, env=environment,
        )  # fmt: skip
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]
