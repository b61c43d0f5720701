"""`walltopo gym serve` as a process of its own, which can be killed and started again."""

from __future__ import annotations

import base64
import hashlib
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

from walltopo_gym.accounts.access import COOKIE
from walltopo_gym.server.app import PREFIX

TUS = {"tus-resumable": "1.0.0"}
PATIENCE_S = 600

# Small and quick: the pipeline is the same code as on any other scene.
QUICK = """\
[sparse]
threads = 1
[dense]
backend = "sparse"
[texture]
size = 512
"""


def wait_for(what: Callable[[], Any]) -> Any:
    """The first result that counts as true."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        found = what()
        if found:
            return found
        if time.monotonic() > deadline:
            raise TimeoutError(f"{what} did not come true; it was {found!r} at last")
        time.sleep(0.1)


class Process:
    """A command of `walltopo gym` on a data folder."""

    def __init__(self, data: Path, command: str, *words: str, **settings: str) -> None:
        # How much room a machine has says nothing about the code.
        settings.setdefault("keep_free_mb", "0")
        environment = {f"WALLTOPO_GYM_{name.upper()}": value for name, value in settings.items()}
        self._log = (data / f"{command}.log").open("ab")
        self._child = subprocess.Popen(
            [sys.executable, "-m", "walltopo", "gym", command, "--data", str(data), *words],
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            env=os.environ | environment,
            start_new_session=True,
        )
        assert self._child.stdout is not None
        begun = select.select([self._child.stdout], [], [], PATIENCE_S)[0]
        self.first_line = self._child.stdout.readline().strip() if begun else ""
        if not self.first_line:
            os.killpg(self._child.pid, signal.SIGKILL)
            self.wait()
            log = (data / f"{command}.log").read_text(errors="replace")
            raise RuntimeError(f"walltopo gym {command} did not begin:\n{log[-3000:]}")

    @property
    def pid(self) -> int:
        """Process id of the command."""
        return self._child.pid

    def kill(self) -> None:
        """SIGKILL, for which nothing can prepare."""
        self._child.send_signal(signal.SIGKILL)
        self.wait()

    def stop(self) -> None:
        """SIGTERM, and wait."""
        if self._child.poll() is None:
            self._child.send_signal(signal.SIGTERM)
            self.wait()

    def wait(self) -> None:
        try:
            self._child.wait(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            os.killpg(self._child.pid, signal.SIGKILL)  # else it slows all that comes after
            raise
        assert self._child.stdout is not None
        self._child.stdout.close()
        self._log.close()


def browser(address: str, cookie: str) -> httpx.Client:
    """Somebody's, on plain HTTP: the cookie is set by hand."""
    return httpx.Client(
        base_url=address + PREFIX, headers={"cookie": f"{COOKIE}={cookie}"}, timeout=PATIENCE_S
    )


def announce(client: httpx.Client, path: str, name: str, content: bytes) -> httpx.Response:
    """Announce a photo, as tus has it."""
    metadata = {"filename": name, "sha256": hashlib.sha256(content).hexdigest()}
    pairs = [
        f"{key} {base64.b64encode(value.encode()).decode()}" for key, value in metadata.items()
    ]
    headers = TUS | {"upload-length": str(len(content)), "upload-metadata": ",".join(pairs)}
    return client.post(path, headers=headers)


def send(client: httpx.Client, place: str, content: bytes, offset: int = 0) -> httpx.Response:
    """Send what is left of a photo from an offset on."""
    headers = TUS | {
        "upload-offset": str(offset),
        "content-type": "application/offset+octet-stream",
    }
    path = place.partition(PREFIX)[2]
    return client.patch(path, headers=headers, content=content[offset:])


def offset_of(client: httpx.Client, place: str) -> int:
    """Return how much of a photo is there."""
    answer = client.head(place.partition(PREFIX)[2], headers=TUS)
    return int(answer.headers["upload-offset"])
