"""A server with a gym for the tests in a browser, and the file that says where things are in it."""

from __future__ import annotations

import json
import os
import subprocess
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

from gym.tests.clips.attempts import an_attempt
from gym.tests.hurried import do_all
from gym.tests.inspections.rounds import photo
from gym.tests.running import QUICK, Process
from gym.tests.worlds import PASSWORD, Server, World, make_world
from sqlalchemy import select

from walltopo.scans.folder import ScanFolder
from walltopo.scans.routes import Routes
from walltopo_gym.climbing.counting import RECOUNTS
from walltopo_gym.clips.models import Clip
from walltopo_gym.clock import now
from walltopo_gym.hold_changes.models import HoldChange, HoldComparison
from walltopo_gym.jobs.queue import Task, enqueue
from walltopo_gym.notifications.messages import DIGEST, MAIL, message_row, store_messages
from walltopo_gym.publishing.models import Placement
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State

ROOT = Path(__file__).resolve().parents[3]
WEB = ROOT / "gym" / "web"
_LIMIT_S = 1100  # below the limit of a test, so that what was printed is shown
SHOTS = Path(os.environ.get("WALLTOPO_SHOTS", ROOT / "build" / "gym-shots"))


def missing_browser() -> str:
    """Return why no test can run in Chromium here; empty where they can."""
    chromium = os.environ.get("WALLTOPO_CHROMIUM", "/usr/bin/chromium")
    if not Path(chromium).exists():
        return f"no browser at {chromium} (make system)"
    if not (WEB / "node_modules/@playwright").is_dir():
        return "gym/web/node_modules is missing (make browser)"
    return ""


def publish_wall(world: World, folder: Path) -> UUID:
    """Publish a finished scan with the routes that were found on it; return its id."""
    found = Routes.load(ScanFolder(folder).routes).routes
    entries: list[dict[str, Any]] = [
        {"number": route.id, "name": f"Moon {route.id}", "setter": "Jana"} for route in found
    ]
    systems = world.server.ask("GET", f"{world.path}/grade-systems", world.owner).json()
    entries[0] |= {"grade": "6A", "grade_system_id": systems[0]["id"]}
    scan = world.finished(folder)
    answer = world.publish(scan, *entries)
    assert answer.is_success, answer.text
    return scan


def report_hold(world: World, scan: UUID, folder: Path) -> Path:
    """Let the member report hold 1; return a photo for its inspection."""
    body = {"wall_id": str(world.wall.id), "scan_id": str(scan), "hold": 1, "kind": "spins"}
    path = f"{world.path}/hold-reports/{uuid4()}"
    assert world.server.ask("PUT", path, world.people["member"], body).is_success
    file = folder / "hold.jpg"
    file.write_bytes(photo((1600, 1200)))
    return file


def confirm_clips(world: World, scan: UUID, number: int) -> None:
    """Let judge and setter confirm clips of a route: a top, and a fall at the third hold."""
    with world.server.database.writing() as session:
        placed = select(Placement).where(Placement.scan_id == scan, Placement.number == number)
        route = session.scalars(placed).one()
        sides = ("left hand", "right hand")
        moves = [(sides[k % 2], hold) for k, hold in enumerate(route.holds)]
        for who, made in (("judge", moves), ("setter", moves[:3])):
            person = world.people[who].id
            assert person is not None
            attempt = an_attempt(made, top=made == moves)
            rows = [{"limb": limb, "hold": hold, "time_s": 1.0} for limb, hold in made]
            facts = {"scan_id": scan, "route_id": route.route_id, "size": 1, "state": "read"}
            session.add(Clip(person_id=person, attempt=attempt, moves=rows, **facts))


def show_changes(world: World, scan: UUID) -> None:
    """Let the comparison with an earlier scan show a turned, a moved and a missing hold."""
    with world.server.database.writing() as session:
        placed = select(Placement).where(Placement.scan_id == scan).order_by(Placement.number)
        first, second = session.scalars(placed).all()[:2]
        session.add(HoldComparison(scan_id=scan, since=now() - timedelta(days=5), compared=12))
        session.flush()
        for route, hold, kind, turn, moved in (
            (first, first.holds[0], "turned", -24.0, 0.002),
            (second, second.holds[0], "moved", 1.5, 0.021),
            (second, None, "gone", None, None),
        ):
            facts = {"hold": hold, "kind": kind, "turn_deg": turn, "moved_m": moved}
            session.add(HoldChange(scan_id=scan, route_id=route.route_id, colour="red", **facts))


def set_jobs_aside(world: World) -> None:
    """Leave what an operator looks at: a failed scan, a job that was set aside, a failed mail."""
    failed = world.scan(State.FAILED, usable=3)
    person = world.people["member"].id
    assert person is not None
    row = message_row(world.gym, person, DIGEST, "2026-48", MAIL, {})
    row |= {"sent_at": now(), "error": "the mail server refused the recipient: 550 unknown"}
    job = replace(RECOUNTS, waits=())
    with world.server.database.writing() as session:
        session.get_one(Scan, failed).error = "too few photos overlap"
        store_messages(session, [row])
        enqueue(session, job, str(world.gym.id), gym=world.gym.id)

    def run(gym: str) -> None:
        raise OSError("the file store is away")

    do_all(world.server, Task(job, run))


def new_world(data: Path) -> World:
    """Make a data folder with a public gym, whose server is not started yet (`serving`)."""
    data.mkdir()
    (data / "quick.toml").write_text(QUICK)
    return make_world(Server(data), visibility="public")


def backups_of(data: Path) -> Path:
    """Return the folder of the backups of `serving`."""
    return data.parent / f"{data.name}-backups"


@contextmanager
def empty_server(data: Path, backups: Path, port: int) -> Iterator[dict[str, str]]:
    """Serve an empty data folder; yields its address and its log.

    Parameters
    ----------
    backups : the folder of backups that it can restore.
    """
    data.mkdir()
    address = f"http://localhost:{port}"
    settings = {"backup_to": str(backups), "workers": "0"}
    process = Process(data, "serve", "--port", str(port), address=address, **settings)
    try:
        yield {"address": address, "log": str(data / "serve.log"), "backups": str(backups)}
    finally:
        process.stop()


@contextmanager
def serving(
    world: World, port: int, address: str, places: Mapping[str, object]
) -> Iterator[dict[str, str]]:
    """Serve the world as a process of its own; yields the environment of a browser test.

    Parameters
    ----------
    address : that browsers open; places : what the test needs beside the gym and its people. It
        gets `restart`, too: see `_restartable`.
    """
    data = world.server.settings.data
    world.server.close()
    SHOTS.mkdir(parents=True, exist_ok=True)
    common = {
        "address": address,
        "log": str(data / "serve.log"),
        "shots": str(SHOTS),
        "password": PASSWORD,
        "gym": world.gym.slug,
        "wall": str(world.wall.id),
    }
    people = {role: who.email for role, who in world.people.items()}
    (data / "places.json").write_text(json.dumps(common | people | dict(places)))
    backups = backups_of(data)
    backups.mkdir(exist_ok=True)
    settings = {
        "scan_settings": str(data / "quick.toml"),
        "new_gyms": "anyone",
        "backup_to": str(backups),
    }

    def start() -> Process:
        return Process(data, "serve", "--port", str(port), address=address, **settings)

    with _restartable(start) as restart:
        written = json.loads((data / "places.json").read_text())
        (data / "places.json").write_text(json.dumps(written | {"restart": restart}))
        yield {**os.environ, "WALLTOPO_PLACES": str(data / "places.json")}


@contextmanager
def _restartable(start: Callable[[], Process]) -> Iterator[str]:
    """Run a server; yield an address where each POST kills it and starts it again."""
    running = [start()]

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            running.pop().kill()
            running.append(start())
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: object) -> None: ...

    control = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=control.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{control.server_port}/"
    finally:
        control.shutdown()
        thread.join()
        control.server_close()
        running.pop().stop()


def playwright(environment: Mapping[str, str], *words: str) -> None:
    """Run browser tests of the app; a failure shows what they printed.

    Parameters
    ----------
    environment : of `serving`; words : options of `playwright test`.
    """
    done = subprocess.run(
        ["node_modules/.bin/playwright", "test", *words],
        cwd=WEB,
        capture_output=True,
        text=True,
        timeout=_LIMIT_S,
        check=False,
        env=environment,
    )
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]
