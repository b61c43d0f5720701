"""A scan whose server is killed in every stage: does it end, and in the same holds?

    python -m gym.benchmarks.kills [--photos DIR] [--elsewhere | --database]

The small rendered gym is scanned twice through the platform: undisturbed, and with SIGKILL to the
process that works on it once in each stage. With `--elsewhere` two workers share the queue beside a
server that does not work: the one that is at it is killed, the other goes on. With `--database` it
is PostgreSQL that is killed, with all of its processes, and started again; meanwhile a setter
makes walls and sends photos, and counts what was acknowledged.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import httpx
from gym.tests.postgres import Postgres, postgres_programs
from gym.tests.running import QUICK, Process, announce, browser, send, wait_for
from gym.tests.worlds import Server, World, make_world, new_database

from walltopo.pipeline.stages import stage_names
from walltopo_lab.synth import write_tiny_gym

_AWAY_S = 2  # how long the database is away
_PACE_S = 0.3  # between two things that the setter does meanwhile


class Works:
    """The processes of one platform: a server that works, or a server and two workers.

    Parameters
    ----------
    postgres, url : what is killed in their stead, and the database in it; None and empty: SQLite.
    """

    def __init__(self, data: Path, elsewhere: bool, postgres: Postgres | None, url: str) -> None:
        self._data, self._elsewhere, self._postgres = data, elsewhere, postgres
        # One thread, so that the same photos give the same bytes.
        (data / "quick.toml").write_text(QUICK)
        self._settings = {"scan_settings": str(data / "quick.toml")}
        self._settings |= {"database": url} if url else {}
        self.server = self._serve()
        self.workers = [self._work() for _ in range(2)] if elsewhere else []

    def _serve(self) -> Process:
        workers = "0" if self._elsewhere else "1"
        return Process(self._data, "serve", "--port", "0", workers=workers, **self._settings)

    def _work(self) -> Process:
        return Process(self._data, "worker", **self._settings)

    def kill(self, scan: str) -> None:
        """Kill the worker of the scan, or the database, and start another one."""
        if self._postgres is not None:
            self._postgres.kill()
            time.sleep(_AWAY_S)
            self._postgres.start()
            return
        if not self._elsewhere:
            self.server.kill()
            self.server = self._serve()
            return
        folders = list((self._data / "work").glob(f"*/{scan}"))
        newest = max(folders, key=lambda folder: folder.stat().st_mtime)
        number = int(newest.parent.name.rpartition("-")[2])
        self.workers[number].kill()
        self.workers[number] = self._work()

    def stop(self) -> None:
        for process in (*self.workers, self.server):
            process.stop()


@contextmanager
def works(elsewhere: bool, database: bool) -> Iterator[tuple[Works, World, Path]]:
    """A platform with a gym."""
    with ExitStack() as held:
        data = Path(held.enter_context(tempfile.TemporaryDirectory()))
        postgres, url = None, ""
        if database:
            programs = postgres_programs()
            if programs is None:
                raise SystemExit("PostgreSQL is not installed (Debian: apt-get install postgresql)")
            postgres = Postgres(programs, fsync=True)
            held.callback(postgres.close)
            postgres.start()
            url = new_database(postgres.address)
        world = make_world(Server(data, url))
        world.server.close()
        running = Works(data, elsewhere, postgres, url)
        held.callback(running.stop)
        yield running, world, data


class Setter(threading.Thread):
    """Somebody who goes on working while the database goes away: makes walls, sends photos.

    `walls` and `photos` (by name, with the hash of their bytes) are what the server has acknowledged;
    `refused` counts answers that asked to try again, `odd` those that were neither.
    """

    def __init__(self, client: httpx.Client, world: World, scan: str) -> None:
        super().__init__(daemon=True)
        self._client, self._path, self._scan = client, world.path, scan
        self.walls: set[str] = set()
        self.photos: dict[str, str] = {}
        self.refused, self.odd = 0, 0
        self.over = threading.Event()

    def run(self) -> None:
        number = 0
        while not self.over.wait(_PACE_S):
            number += 1
            name = f"Wall {number}"
            announce_again = partial(self._client.post, f"{self._path}/walls", json={"name": name})
            answer = self._patiently(announce_again)
            # A request that was done and not acknowledged is refused the second time.
            if answer.status_code == 201:
                self.walls.add(name)
            elif answer.status_code != 409:
                self.odd += 1
            if number % 5 == 0:
                self._send(f"{number}.jpg", hashlib.sha256(name.encode()).digest() * 2000)

    def _send(self, name: str, content: bytes) -> None:
        """By tus; what is here of it already is not sent again."""
        path = f"{self._path}/scans/{self._scan}/photos"
        announce_again = partial(announce, self._client, path, name, content)
        response = self._patiently(announce_again)
        if response.status_code == 201:
            place, here = response.headers["location"], int(response.headers["upload-offset"])
            response = self._patiently(partial(send, self._client, place, content, here))
        if response.status_code == 409:  # all of it was taken, and that was not acknowledged
            response = self._patiently(announce_again)
        if response.is_success:
            self.photos[name] = hashlib.sha256(content).hexdigest()
        else:
            self.odd += 1

    def _patiently(self, ask: Callable[[], httpx.Response]) -> httpx.Response:
        """Ask again for as long as the server says so."""
        while (answer := ask()).status_code == 503:
            self.refused += 1
            time.sleep(0.2)
        return answer

    def kept(self, data: Path) -> str:
        """Return a sentence on the acknowledged walls and photos that are there at the end."""
        rows = self._client.get(f"{self._path}/walls").json()
        names = [row["name"] for row in rows]
        there = sum(names.count(name) == 1 for name in self.walls)
        files = data / "files" / "originals"
        equal = sum(
            hashlib.sha256((files / digest).read_bytes()).hexdigest() == digest
            for digest in self.photos.values()
            if (files / digest).is_file()
        )
        listed = [
            row["name"]
            for row in self._client.get(f"{self._path}/scans/{self._scan}/photos").json()
        ]
        once = sum(listed.count(name) == 1 for name in self.photos)
        return (
            f"acknowledged meanwhile: {len(self.walls)} walls, {len(self.photos)} photos; "
            f"there once: {there} walls, {once} photos, with equal bytes: {equal}; "
            f"asked to try again: {self.refused}, other answers: {self.odd}"
        )


def scanned(photos: Path, kill: bool, elsewhere: bool, database: bool) -> dict[str, Any]:
    """One scan through the platform: what came of it."""
    with works(elsewhere, database) as (running, world, data):
        cookie = world.people["setter"].headers["cookie"].partition("=")[2]
        client = browser(running.server.first_line, cookie)
        scan, other = (
            client.post(f"{world.path}/walls/{world.wall.id}/scans").json()["id"] for _ in range(2)
        )
        path = f"{world.path}/scans/{scan}"
        for file in sorted(photos.iterdir()):
            content = file.read_bytes()
            place = announce(client, f"{path}/photos", file.name, content).headers["location"]
            assert send(client, place, content).status_code == 204
        wait_for(lambda: {p["state"] for p in client.get(f"{path}/photos").json()} == {"usable"})
        setter = Setter(browser(running.server.first_line, cookie), world, other)
        if kill and database:
            setter.start()
        begun = time.monotonic()
        assert client.post(f"{path}/start").status_code == 200
        killed: list[str] = []
        while (facts := _facts(running, cookie, path)) and facts["state"] in ("queued", "running"):
            stage = (facts["progress"] or {}).get("stage")
            if kill and stage and stage not in killed:
                killed.append(stage)
                running.kill(scan)
            time.sleep(0.05)
        kept = ""
        if setter.is_alive():
            setter.over.set()
            setter.join()
            kept = setter.kept(data)
        holds = data / "files" / "scans" / scan / "holds.json"
        digest = hashlib.sha256(holds.read_bytes()).hexdigest() if holds.is_file() else ""
        manifest = json.loads((holds.parent / "scan.json").read_text())
        return {
            "state": facts["state"],
            "error": facts["error"],
            "killed": killed,
            "holds": digest,
            "stages": len(manifest["stages"]),
            "seconds": time.monotonic() - begun,
            "kept": kept,
        }


def _facts(running: Works, cookie: str, path: str) -> dict[str, Any]:
    """How the scan is; asked of the server that is there now."""
    while True:
        try:
            answer = browser(running.server.first_line, cookie).get(path)
            if answer.is_success:
                facts: dict[str, Any] = answer.json()
                return facts
        except httpx.HTTPError:
            pass
        time.sleep(0.1)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--photos", type=Path, help="default: the small rendered gym")
    whom = parser.add_mutually_exclusive_group()
    whom.add_argument("--elsewhere", action="store_true", help="another worker goes on")
    whom.add_argument("--database", action="store_true", help="PostgreSQL is killed")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        photos = args.photos or write_tiny_gym(Path(name) / "gym") / "photos"
        calm = scanned(photos, False, args.elsewhere, args.database)
        rough = scanned(photos, True, args.elsewhere, args.database)
    print(f"undisturbed: {calm['state']}, {calm['stages']} stages {calm['error']}")
    print(
        f"killed in {len(rough['killed'])} of {len(stage_names())} stages "
        f"({', '.join(rough['killed'])}): {rough['state']} {rough['error']}"
    )
    print(f"the same holds.json: {'yes' if calm['holds'] == rough['holds'] else 'no'}")
    if args.database:
        print(rough["kept"])
    print(f"time: {rough['seconds'] / calm['seconds']:.1f} × undisturbed")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
