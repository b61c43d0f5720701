"""A scan whose server is killed in every stage: does it end, and in the same holds?

    python -m gym.benchmarks.kills [--photos DIR] [--elsewhere]

The small rendered gym is scanned twice through the platform: undisturbed, and with SIGKILL to the
process that works on it once in each stage. With `--elsewhere` two workers share the queue beside a
server that does not work: the one that is at it is killed, the other goes on.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
from gym.tests.running import Process, announce, browser, send, wait_for
from gym.tests.worlds import Server, World, make_world

from walltopo.pipeline.stages import stage_names
from walltopo_lab.synth import tiny

# Small and quick; one thread, so that the same photos give the same bytes.
_QUICK = '[sparse]\nthreads = 1\n[dense]\nbackend = "sparse"\n[texture]\nsize = 512\n'


class Works:
    """The processes of one platform: a server that works, or a server and two workers."""

    def __init__(self, data: Path, elsewhere: bool) -> None:
        self._data, self._elsewhere = data, elsewhere
        (data / "quick.toml").write_text(_QUICK)
        self._settings = {"scan_settings": str(data / "quick.toml"), "silent_s": "8"}
        self.server = self._serve()
        self.workers = [self._work() for _ in range(2)] if elsewhere else []

    def _serve(self) -> Process:
        workers = "0" if self._elsewhere else "1"
        return Process(self._data, "serve", "--port", "0", workers=workers, **self._settings)

    def _work(self) -> Process:
        return Process(self._data, "worker", **self._settings)

    def kill(self, scan: str) -> None:
        """Kill whoever works on the scan, and start one of its kind again."""
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
def works(elsewhere: bool) -> Iterator[tuple[Works, World, Path]]:
    """A platform with a gym."""
    with tempfile.TemporaryDirectory() as name:
        data = Path(name)
        world = make_world(Server(data))
        world.server.close()
        running = Works(data, elsewhere)
        try:
            yield running, world, data
        finally:
            running.stop()


def scanned(photos: Path, kill: bool, elsewhere: bool) -> dict[str, Any]:
    """One scan through the platform: what came of it."""
    with works(elsewhere) as (running, world, data):
        cookie = world.people["setter"].headers["cookie"].partition("=")[2]
        client = browser(running.server.said, cookie)
        scan = client.post(f"{world.path}/walls/{world.wall.id}/scans").json()["id"]
        path = f"{world.path}/scans/{scan}"
        for file in sorted(photos.iterdir()):
            content = file.read_bytes()
            place = announce(client, f"{path}/photos", file.name, content).headers["location"]
            assert send(client, place, content).status_code == 204
        wait_for(lambda: {p["state"] for p in client.get(f"{path}/photos").json()} == {"usable"})
        begun = time.monotonic()
        assert client.post(f"{path}/start").status_code == 200
        killed: list[str] = []
        while (facts := _facts(running, cookie, path)) and facts["state"] in ("queued", "running"):
            stage = (facts["progress"] or {}).get("stage")
            if kill and stage and stage not in killed:
                killed.append(stage)
                running.kill(scan)
            time.sleep(0.05)
        holds = data / "files" / "scans" / scan / "holds.json"
        digest = hashlib.sha256(holds.read_bytes()).hexdigest() if holds.is_file() else ""
        manifest = json.loads((holds.parent / "scan.json").read_text())
        return {"state": facts["state"], "error": facts["error"], "killed": killed, "holds": digest,
                "stages": len(manifest["stages"]), "seconds": time.monotonic() - begun}  # fmt: skip


def _facts(running: Works, cookie: str, path: str) -> dict[str, Any]:
    """How the scan is; asked of the server that is there now."""
    while True:
        try:
            facts: dict[str, Any] = browser(running.server.said, cookie).get(path).json()
            return facts
        except httpx.HTTPError:
            time.sleep(0.1)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--photos", type=Path, help="default: the small rendered gym")
    parser.add_argument("--elsewhere", action="store_true", help="another worker goes on")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        photos = args.photos or tiny(Path(name) / "gym") / "photos"
        calm = scanned(photos, False, args.elsewhere)
        rough = scanned(photos, True, args.elsewhere)
    print(f"undisturbed: {calm['state']}, {calm['stages']} stages {calm['error']}")
    print(f"killed in {len(rough['killed'])} of {len(stage_names())} stages "
          f"({', '.join(rough['killed'])}): {rough['state']} {rough['error']}")  # fmt: skip
    print(f"the same holds.json: {'yes' if calm['holds'] == rough['holds'] else 'no'}")
    print(f"time: {rough['seconds'] / calm['seconds']:.1f} × undisturbed")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
