"""The web app in three engines and on bad networks: `gym/web/tests/engines`."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

import pytest
from gym.tests.competitions.contest import Contest
from gym.tests.postgres import free_port
from gym.tests.web.places import WEB, new_world, playwright, publish_wall, serving
from gym.tests.worlds import World

ENGINES = {"chromium": "chromium", "firefox": "firefox-esr", "webkit": "WebKitWebDriver"}
NETWORKS = ("3G", "a proxy that holds streams back", "IPv6 alone", "a server that restarts")

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("engine", ENGINES)
def test_the_app_in_another_engine(
    engine: str,
    tmp_path: Path,
    tiny_photos: Path,
    tiny_scan: Path,
    lacks: Callable[[str], NoReturn],
) -> None:
    with _served(engine, tmp_path, tiny_photos, tiny_scan, lacks) as environment:
        playwright(environment, "-c", "tests/engines", f"--project={engine}", "flows.spec.mjs")


@pytest.mark.parametrize("network", NETWORKS)
def test_the_app_on_a_bad_network(
    network: str,
    tmp_path: Path,
    tiny_photos: Path,
    tiny_scan: Path,
    lacks: Callable[[str], NoReturn],
) -> None:
    words = ("--project=chromium", "networks.spec.mjs", "--grep", f"{network}$")
    with _served("chromium", tmp_path, tiny_photos, tiny_scan, lacks) as environment:
        playwright(environment, "-c", "tests/engines", *words)


@contextmanager
def _served(
    engine: str, folder: Path, photos: Path, scan: Path, lacks: Callable[[str], NoReturn]
) -> Iterator[dict[str, str]]:
    """Serve a gym with a wall and a competition; yields the environment of an engine's test."""
    wanted = (ENGINES[engine], "Xvfb", "openssl")
    missing = [program for program in wanted if shutil.which(program) is None]
    if missing or not (WEB / "node_modules/@playwright").is_dir():
        lacks(f"{', '.join(missing) or 'gym/web/node_modules'} is missing (make system browser)")
    world = new_world(folder / "app")
    publish_wall(world, scan)
    target, port = free_port(), free_port()
    places = {
        "photos": str(photos),
        "later": str(world.finished(scan)),
        "competition": _competition(world),
        "port": port,
        "target": target,
        **_certificate(folder),
    }
    with _screen() as display, serving(world, target, f"https://localhost:{port}", places) as env:
        yield {**env, "DISPLAY": display}


def _competition(world: World) -> dict[str, str]:
    """Make a competition that is running, with one competitor; return what a score event names."""
    contest = Contest(world).make()
    contest.move("running")
    made = {"id": contest.sheet["id"], "problem": contest.problem(0)}
    return made | {"entry": contest.entry("Anna Roth")}


def _certificate(folder: Path) -> dict[str, str]:
    """Make a certificate for localhost, which the browsers then accept."""
    key, certificate = folder / "key.pem", folder / "certificate.pem"
    subprocess.run(
        [
            "openssl",
            "req",
            "-x509",
            "-newkey",
            "rsa:2048",
            "-nodes",
            "-days",
            "2",
            "-subj",
            "/CN=localhost",
            "-keyout",
            key,
            "-out",
            certificate,
        ],
        check=True,
        capture_output=True,
    )
    return {"key": key.read_text(), "certificate": certificate.read_text()}


@contextmanager
def _screen() -> Iterator[str]:
    """Start an X server without a screen; yields its display."""
    words = ["Xvfb", "-displayfd", "1", "-screen", "0", "1280x1000x24", "-nolisten", "tcp"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as server:
        assert server.stdout is not None
        try:
            yield f":{server.stdout.readline().decode().strip()}"
        finally:
            server.terminate()
