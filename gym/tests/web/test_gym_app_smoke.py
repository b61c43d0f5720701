"""The shortest way through the web app in a real browser: `gym/web/tests/smoke`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from gym.tests.postgres import free_port
from gym.tests.web.places import missing_browser, new_world, playwright, publish_wall, serving


def test_a_climber_ticks_a_route(
    tmp_path: Path, tiny_scan: Path, lacks: Callable[[str], NoReturn]
) -> None:
    if missing_browser():
        lacks(missing_browser())
    world = new_world(tmp_path / "app")
    publish_wall(world, tiny_scan)
    port = free_port()
    with serving(world, port, f"http://localhost:{port}", {}) as environment:
        playwright(environment, "-c", "tests/smoke")
