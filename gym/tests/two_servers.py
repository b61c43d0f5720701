"""Two servers and two workers behind one address, as on two machines: they share a database and a
bucket, and each has a data folder of its own. One of the four is killed now and then under load.

    python -m gym.tests.two_servers --minutes 10 --every 30
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import statistics
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import httpx
import numpy as np
from gym.tests.competitions.contest import Contest
from gym.tests.postgres import Postgres, free_port, postgres_programs
from gym.tests.running import Process, announce, offset_of, send
from gym.tests.s3 import BUCKET, s3_server
from gym.tests.worlds import Server, World, make_world, new_database
from PIL import Image
from sqlalchemy import func, select, text

from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.competitions.models import ScoreEvent
from walltopo_gym.scans.models import Photo
from walltopo_gym.server.app import PREFIX
from walltopo_gym.webhooks.models import WebhookEvent


class Proxy:
    """Passes each connection to the next server that accepts one, as a load balancer does."""

    def __init__(self, ports: tuple[int, ...]) -> None:
        self._ports, self._turn = ports, 0
        self.port = free_port()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._begun = threading.Event()
        self._thread.start()
        self._begun.wait()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(
            asyncio.start_server(self._serve, "127.0.0.1", self.port, backlog=200)
        )
        self._begun.set()
        self._loop.run_forever()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        upstream = await self._connect()
        if upstream is None:
            writer.close()
            return
        await asyncio.gather(_pipe(reader, upstream[1]), _pipe(upstream[0], writer))

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter] | None:
        for _ in self._ports:
            self._turn += 1
            port = self._ports[self._turn % len(self._ports)]
            with suppress(OSError):
                return await asyncio.open_connection("127.0.0.1", port)
        return None

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()


async def _pipe(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with suppress(OSError):
        while piece := await reader.read(65536):
            writer.write(piece)
            await writer.drain()
    writer.close()


@dataclass
class Tally:
    """The counts of a run under load.

    Parameters
    ----------
    acknowledged : ids that a server said it had stored, by kind.
    retried : requests that were sent again, by the reason.
    slowest_s : the longest time from the first try of a request to its answer, by kind.
    quiet_s : times between two messages of a live board that is watched.
    photos : the content's size of each photo that was sent whole, by its id.
    deliveries : how often each webhook message came.
    """

    acknowledged: dict[str, set[UUID]] = field(default_factory=dict)
    retried: Counter[str] = field(default_factory=Counter)
    slowest_s: dict[str, float] = field(default_factory=dict)
    quiet_s: list[float] = field(default_factory=list)
    photos: dict[UUID, int] = field(default_factory=dict)
    deliveries: Counter[str] = field(default_factory=Counter)
    kills: Counter[str] = field(default_factory=Counter)
    refused: list[str] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def acknowledge(self, kind: str, row: UUID, took_s: float) -> None:
        with self.lock:
            self.acknowledged.setdefault(kind, set()).add(row)
            self.slowest_s[kind] = max(self.slowest_s.get(kind, 0.0), took_s)


@dataclass
class Site:
    """The four processes, their address, and a gym."""

    address: str
    contest: Contest
    route: str
    tally: Tally
    processes: dict[str, Process]
    start: Callable[[str], Process]
    database: str
    webhook: str
    stop: threading.Event = field(default_factory=threading.Event)

    @property
    def world(self) -> World:
        return self.contest.world

    def client(self, who: str) -> httpx.Client:
        headers = self.world.people[who].headers
        return httpx.Client(base_url=self.address + PREFIX, headers=headers, timeout=20)

    def until_done(self, kind: str, act: Callable[[], httpx.Response], row: UUID) -> None:
        """Repeat a request until a server answers it, as a phone's outbox does."""
        begun = time.monotonic()
        while True:
            try:
                answer = act()
            except httpx.HTTPError as error:
                with self.tally.lock:
                    self.tally.retried[type(error).__name__] += 1
                time.sleep(0.2)
                continue
            if answer.status_code in (502, 503, 504, 429):
                with self.tally.lock:
                    self.tally.retried[str(answer.status_code)] += 1
                time.sleep(0.2)
                continue
            break
        if answer.is_success:
            self.tally.acknowledge(kind, row, time.monotonic() - begun)
        else:
            with self.tally.lock:
                self.tally.refused.append(f"{kind}: {answer.status_code} {answer.text[:200]}")


def judge(site: Site, entry: str) -> None:
    """Enter attempts of a competitor, one after the other."""
    client, attempt = site.client("judge"), 0
    while not site.stop.is_set():
        attempt, event, at = attempt + 1, uuid4(), now().isoformat()
        body = {
            "entry_id": entry,
            "kind": "attempt",
            "n": attempt % 90 + 1,
            "problem_id": site.contest.problem(attempt % 4),
            "number": attempt,
            "device": "d",
            "made_at": at,
            "sent_at": at,
        }
        path = f"{site.contest.path}/events/{event}"
        site.until_done("scores", partial(client.put, path, json=body), event)
        site.stop.wait(0.3)


def climber(site: Site, who: str) -> None:
    """Log ascents."""
    client = site.client(who)
    while not site.stop.is_set():
        ascent = uuid4()
        body = {"route_id": site.route, "kind": "top", "climbed_at": now().isoformat()}
        path = f"{site.world.path}/ascents/{ascent}"
        site.until_done("ascents", partial(client.put, path, json=body), ascent)
        site.stop.wait(0.2)


def setter(site: Site) -> None:
    """Add routes, about which the gym's webhook hears."""
    client, number = site.client("setter"), 0
    while not site.stop.is_set():
        number += 1
        body = {"routes": [{"name": f"Route {number}"}]}
        path = f"{site.world.path}/walls/{site.world.wall.id}/routes"
        with suppress(httpx.HTTPError):
            client.post(path, json=body)
        site.stop.wait(1.0)


def photographer(site: Site, scan: UUID, seed: int) -> None:
    """Send photos in pieces; after an interruption ask how much is there, and go on."""
    client, rng = site.client("setter"), np.random.default_rng(seed)
    while not site.stop.is_set():
        out = BytesIO()
        Image.fromarray(rng.integers(0, 255, (600, 800, 3), dtype=np.uint8)).save(out, "JPEG")
        content, begun = out.getvalue(), time.monotonic()
        place = _announced(site, client, scan, content)
        photo = UUID(place.rstrip("/").rpartition("/")[2])
        while not _sent(site, client, place, content):
            time.sleep(0.2)
        with site.tally.lock:
            site.tally.photos[photo] = len(content)
        site.tally.acknowledge("photos", photo, time.monotonic() - begun)
        site.stop.wait(3.0)  # a scan has at most 400


def _announced(site: Site, client: httpx.Client, scan: UUID, content: bytes) -> str:
    path = f"{site.world.path}/scans/{scan}/photos"
    while True:
        with suppress(httpx.HTTPError):
            answer = announce(client, path, f"{uuid4()}.jpg", content)
            if answer.status_code == 201:
                return answer.headers["location"]
            raise RuntimeError(f"a photo was refused: {answer.status_code} {answer.text}")
        time.sleep(0.2)


def _sent(site: Site, client: httpx.Client, place: str, content: bytes) -> bool:
    """Send the rest of a photo in three pieces; return whether it is whole."""
    try:
        offset = offset_of(client, place)
        while offset < len(content):
            end = min(len(content), offset + len(content) // 3 + 1)
            answer = send(client, place, content[:end], offset)
            if answer.status_code != 204:
                with site.tally.lock:
                    site.tally.retried[f"piece {answer.status_code}"] += 1
                return False
            offset = end
    except (httpx.HTTPError, KeyError) as error:
        with site.tally.lock:
            site.tally.retried[f"piece {type(error).__name__}"] += 1
        return False
    return True


def watcher(site: Site) -> None:
    """Watch the live board, and open it again when it breaks off."""
    last = time.monotonic()
    while not site.stop.is_set():
        try:
            path = f"{site.contest.path}/board/events"
            with site.client("member") as client, client.stream("GET", path) as answer:
                for line in answer.iter_lines():
                    if line.startswith("data:"):
                        site.tally.quiet_s.append(time.monotonic() - last)
                        last = time.monotonic()
                    if site.stop.is_set():
                        return
        except httpx.HTTPError:
            time.sleep(0.2)


def kill_one_after_another(site: Site, every_s: float, names: Iterator[str]) -> None:
    """Kill a process by SIGKILL and start it again, until the end."""
    while not site.stop.wait(every_s):
        name = next(names)
        site.processes[name].kill()
        site.tally.kills[name] += 1
        site.processes[name] = site.start(name)


@contextmanager
def two_servers() -> Iterator[Site]:
    """Start everything."""
    programs = postgres_programs()
    if programs is None:
        raise RuntimeError("PostgreSQL is not installed: its initdb and pg_ctl are needed")
    with ExitStack() as stack:
        postgres = Postgres(programs, fsync=True)
        postgres.start()
        stack.callback(postgres.close)
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        os.environ |= stack.enter_context(s3_server())
        tally = Tally()
        url, webhook = new_database(postgres.address), _receiver(stack, tally)
        contest, route = _gym(stack, folder / "world", url, webhook)
        ports = {"server a": free_port(), "server b": free_port()}
        settings = {
            "database": url,
            "objects": f"s3://{BUCKET}",
            "requests_per_minute": "0",
            "webhooks_to_private": "true",
            "workers": "0",
        }

        def start(name: str) -> Process:
            data = folder / name.replace(" ", "-")
            data.mkdir(exist_ok=True)
            if name in ports:
                return Process(data, "serve", "--port", str(ports[name]), **settings)
            return Process(data, "worker", **{**settings, "workers": "1"})

        proxy = Proxy(tuple(ports.values()))
        stack.callback(proxy.close)
        processes = {name: start(name) for name in (*ports, "worker a", "worker b")}
        address = f"http://127.0.0.1:{proxy.port}"
        site = Site(address, contest, route, tally, processes, start, url, webhook)
        try:
            yield site
        finally:
            site.stop.set()
            for process in site.processes.values():
                process.stop()


def _receiver(stack: ExitStack, tally: Tally) -> str:
    """Start the gym's own program, which counts the webhook messages; return its address."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["content-length"]))
            with tally.lock:
                tally.deliveries[self.headers["webhook-id"]] += 1
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: object) -> None: ...

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    stack.callback(server.shutdown)
    return f"http://127.0.0.1:{server.server_port}/"


def _gym(stack: ExitStack, folder: Path, url: str, webhook: str) -> tuple[Contest, str]:
    """Make a gym with a running competition, a route and a webhook."""
    folder.mkdir()
    server = Server(folder, url, webhooks_to_private=True)
    stack.callback(server.close)
    world = make_world(server)
    contest = Contest(world).make()
    contest.move("running")
    path = f"{world.path}/walls/{world.wall.id}/routes"
    body = {"routes": [{"name": "Moon"}]}
    made = server.ask("POST", path, world.people["setter"], body).json()
    hook = server.ask("POST", f"{world.path}/webhooks", world.owner, {"url": webhook})
    assert hook.is_success, hook.text
    return contest, str(made[0]["id"])


def load(site: Site, seconds: float, every_s: float, seed: int = 0) -> None:
    """Let people work, and kill processes, for so long; then wait until all jobs are done."""
    chance = random.Random(seed)
    names = iter(lambda: chance.choice(list(site.processes)), None)
    entries = [site.contest.entry(f"Climber {n}") for n in range(3)]
    scans = [site.world.scan() for _ in range(2)]
    work: list[tuple[Callable[..., None], tuple[Any, ...]]] = [
        *((judge, (site, entry)) for entry in entries),
        *((climber, (site, who)) for who in ("member", "judge")),
        *((photographer, (site, scan, n)) for n, scan in enumerate(scans)),
        *((watcher, (site,)) for _ in range(3)),
        (setter, (site,)),
        (kill_one_after_another, (site, every_s, names)),
    ]
    threads = [threading.Thread(target=act, args=args) for act, args in work]
    for thread in threads:
        thread.start()
    time.sleep(seconds)
    site.stop.set()
    for thread in threads:
        thread.join()
    _wait_for_jobs(site)


def _wait_for_jobs(site: Site) -> None:
    """Wait until each webhook message was delivered."""
    deadline = time.monotonic() + 300
    while messages(site) - site.tally.deliveries.keys():
        if time.monotonic() > deadline:
            raise TimeoutError("webhook messages were not delivered")
        time.sleep(0.5)


def messages(site: Site) -> set[str]:
    """Return the ids of all webhook messages."""
    with site.world.server.database.reading() as session:
        return {str(row) for row in session.scalars(select(WebhookEvent.id))}


def lost(site: Site) -> dict[str, int]:
    """Return how many acknowledged writes are not there, by kind."""
    rows = {"scores": ScoreEvent.id, "ascents": Ascent.id}
    missing = {}
    with site.world.server.database.reading() as session:
        for kind, column in rows.items():
            stored = set(session.scalars(select(column)))
            missing[kind] = len(site.tally.acknowledged.get(kind, set()) - stored)
        kept = dict(session.execute(select(Photo.id, Photo.size)).all())
        whole = set(session.scalars(select(Photo.id).where(Photo.state != "receiving")))
    right = [kept.get(one) == size and one in whole for one, size in site.tally.photos.items()]
    missing["photos"] = right.count(False)
    return missing


def open_jobs(site: Site) -> int:
    """Return the number of jobs that wait or run."""
    waits = "status IN ('ENQUEUED', 'PENDING')"
    count = text(f"SELECT count(*) FROM dbos.workflow_status WHERE {waits}")
    with site.world.server.database.reading() as session:
        return session.scalar(count) or 0


def board_is_right(site: Site) -> bool:
    """Return whether both servers show the board of all stored scores."""
    with site.world.server.database.reading() as session:
        stored = session.scalar(select(func.max(ScoreEvent.seq)))
    boards = [site.client("member").get(f"{site.contest.path}/board").json() for _ in range(4)]
    return {board["seq"] for board in boards} == {stored}


def figures(site: Site) -> dict[str, Any]:
    """Return the figures of a run."""
    tally = site.tally
    return {
        "kills": dict(tally.kills),
        "acknowledged": {kind: len(rows) for kind, rows in tally.acknowledged.items()},
        "lost": lost(site),
        "slowest_s": {kind: round(value, 1) for kind, value in tally.slowest_s.items()},
        "sent again": dict(tally.retried),
        "refused": tally.refused[:10],
        "board": {
            "messages": len(tally.quiet_s),
            "longest quiet_s": round(max(tally.quiet_s, default=0.0), 1),
            "median_s": round(statistics.median(tally.quiet_s or [0.0]), 2),
            "right at the end": board_is_right(site),
        },
        "webhooks": {
            "messages": len(tally.deliveries),
            "delivered twice": sum(count > 1 for count in tally.deliveries.values()),
        },
    }


def main() -> int:
    """Run for some minutes and print the figures; return 1 if a write was lost."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--every", type=float, default=30, help="seconds from kill to kill")
    args = parser.parse_args()
    with two_servers() as site:
        load(site, 60 * args.minutes, args.every)
        found = figures(site)
    sys.stdout.write(json.dumps(found, indent=1) + "\n")
    return int(any(found["lost"].values()))


if __name__ == "__main__":
    sys.exit(main())
