"""Photos sent over a connection that breaks, to a server that is killed: what arrives.

    python -m gym.benchmarks.uploads [--photos 1000] [--kill-every 50] [--seed 0]

Each photo (random bytes, 20 to 400 kB) is sent by tus; four of five sends are cut at a random byte,
closed without a word, and gone on with where the server says. Eight phones at a time; after every
so many photos the server gets SIGKILL and is started again. Then every stored file is read.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import socket
import sqlite3
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlsplit

import httpx
from gym.tests.running import Process, announce, browser, offset_of, send
from gym.tests.worlds import Server, make_world

_PHONES = 8
_PORT_S = 0.2


class Hall:
    """A server that is killed now and then; phones wait until it is there again."""

    def __init__(self, data: Path, kill_every: int) -> None:
        self._data, self._kill_every = data, kill_every
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = int(probe.getsockname()[1])
        self.kills, self.done = 0, 0
        self._lock = threading.Lock()
        self._process = self._start()

    def _start(self) -> Process:
        return Process(
            self._data,
            "serve",
            "--port",
            str(self.port),
            workers="0",
            max_photos="5000",
            requests_per_minute="0",
        )

    def arrived(self) -> None:
        """Another photo is there; perhaps it is time."""
        with self._lock:
            self.done += 1
            if self.done % self._kill_every == 0:
                self._process.kill()
                self.kills += 1
                self._process = self._start()

    def stop(self) -> None:
        self._process.stop()


def send_badly(
    rng: random.Random,
    address: str,
    headers: httpx.Headers,
    place: str,
    content: bytes,
    counted: Counter[str],
) -> None:
    """One photo, however often it takes."""
    client = httpx.Client(base_url=address + "/api/v1", headers=headers, timeout=20)
    with client:
        while True:
            try:
                offset = offset_of(client, place)
                if offset == len(content):
                    # All bytes are here; the answer that says so may have been lost on the way.
                    if send(client, place, b"", offset).status_code == 204:
                        return
                elif rng.random() < 0.8:
                    counted["cut"] += 1
                    cut_short(address, headers, place, content, offset, rng)
                elif send(client, place, content, offset).status_code == 204:
                    return
            except (httpx.HTTPError, OSError, KeyError):
                counted["refused"] += 1
                time.sleep(_PORT_S)


def cut_short(
    address: str,
    headers: httpx.Headers,
    place: str,
    content: bytes,
    offset: int,
    rng: random.Random,
) -> None:
    """Begin to send the rest, and go after some bytes, or in the middle of the headers."""
    parts = urlsplit(address)
    head = (
        f"PATCH {place} HTTP/1.1\r\nhost: {parts.netloc}\r\ncookie: {headers['cookie']}\r\n"
        f"tus-resumable: 1.0.0\r\nupload-offset: {offset}\r\n"
        "content-type: application/offset+octet-stream\r\n"
        f"content-length: {len(content) - offset}\r\n\r\n"
    ).encode()
    whole = head + content[offset:]
    with socket.create_connection((parts.hostname or "", parts.port or 80), 20) as stream:
        stream.sendall(whole[: rng.randrange(1, len(whole))])


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--photos", type=int, default=1000)
    parser.add_argument("--kill-every", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(arguments)
    counted: Counter[str] = Counter()
    contents: dict[str, bytes] = {}
    lock = threading.Lock()
    with tempfile.TemporaryDirectory() as name:
        data = Path(name)
        world = make_world(Server(data))
        scan = world.scan()
        world.server.close()
        cookie = world.people["setter"].headers["cookie"].partition("=")[2]
        hall = Hall(data, args.kill_every)
        address = f"http://127.0.0.1:{hall.port}"

        def one(number: int) -> None:
            rng = random.Random(args.seed * 1_000_003 + number)
            content = rng.randbytes(rng.randrange(20_000, 400_000))
            with browser(address, cookie) as client:
                headers = client.headers
                while True:
                    try:
                        path = f"{world.path}/scans/{scan}/photos"
                        answer = announce(client, path, f"{number}.jpg", content)
                        place = answer.headers["location"]
                        break
                    except (httpx.HTTPError, KeyError):
                        counted["refused"] += 1
                        time.sleep(_PORT_S)
            send_badly(rng, address, headers, place, content, counted)
            with lock:
                contents[hashlib.sha256(content).hexdigest()] = content
            hall.arrived()

        with ThreadPoolExecutor(_PHONES) as phones:
            list(phones.map(one, range(args.photos)))
        hall.stop()
        print_figures(data, contents, hall, counted)
    return 0


def print_figures(
    data: Path, contents: dict[str, bytes], hall: Hall, counted: Counter[str]
) -> None:
    """Contents of the database and of the store."""
    with sqlite3.connect(data / "gym.sqlite") as base:
        rows = Counter(row[0] for row in base.execute("SELECT sha256 FROM photos"))
        waiting = base.execute("SELECT count(*) FROM photos WHERE state = 'receiving'").fetchone()
    store = data / "files" / "originals"
    equal = sum((store / key).read_bytes() == content for key, content in contents.items())
    print(f"photos sent: {len(contents)}")
    print(f"sends cut: {counted['cut']}, while the server was away: {counted['refused']}")
    print(f"server killed: {hall.kills}")
    print(f"stored: {len(list(store.iterdir()))}, bytes equal: {equal}")
    print(
        f"rows: {sum(rows.values())}, twice: {sum(n > 1 for n in rows.values())}, "
        f"unfinished: {waiting[0]}"
    )
    print(f"left in incoming: {len(list((data / 'incoming').iterdir()))}")


if __name__ == "__main__":
    raise SystemExit(main())
