"""`walltopo view` as a process: how it begins, ends, and what the terminal sees meanwhile."""

from __future__ import annotations

import os
import random
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from walltopo.cli import main
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]
PATIENCE_S = 900


@pytest.fixture
def root(make_scan: MakeScan) -> Path:
    scan = make_scan(cells=20)
    scan.page.write_text("<wall-topo src=x></wall-topo>")
    return scan.root


@dataclass
class Viewing:
    """A running `walltopo view`: its port, the page's path, and the file of all that it says."""

    process: subprocess.Popen[bytes]
    port: int
    path: str
    terminal: Path

    def end(self, number: signal.Signals = signal.SIGINT) -> str:
        """End it by a signal; what it has said."""
        self.process.send_signal(number)
        self.process.wait(timeout=PATIENCE_S)
        return self.terminal.read_text()


@contextmanager
def viewing(root: Path, *more: str) -> Iterator[Viewing]:
    """The process, once it has said where it is and how to end it."""
    terminal, deadline = root.parent / "terminal.txt", time.monotonic() + PATIENCE_S
    command = [sys.executable, "-u", "-m", "walltopo", "view", str(root), "--port", "0", *more]
    with terminal.open("wb") as stream:
        process = subprocess.Popen(
            command, stdout=stream, stderr=subprocess.STDOUT, start_new_session=True
        )
    try:
        pause = threading.Event()
        while "Ctrl-C stops." not in terminal.read_text():
            assert process.poll() is None, terminal.read_text()
            assert time.monotonic() < deadline, terminal.read_text()
            pause.wait(0.05)
        found = re.match(r"http://127\.0\.0\.1:(\d+)(/\S*)", terminal.read_text())
        assert found
        yield Viewing(process, int(found[1]), found[2], terminal)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def ask(port: int, sent: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as wire:
        wire.sendall(sent)
        return wire.recv(12)


def request(port: int, path: str = "/") -> bytes:
    return f"GET {path} HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n".encode()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ends_well_by_a_signal_with_connections_open(root: Path, number: signal.Signals) -> None:
    with viewing(root) as view:
        port = view.port
        assert ask(port, request(port)) == b"HTTP/1.1 200"
        idle = socket.create_connection(("127.0.0.1", port))
        half = socket.create_connection(("127.0.0.1", port))
        half.sendall(b"GET / HT")
        shown = view.end(number)
        idle.close()
        half.close()
    assert view.process.returncode == 0
    assert shown.splitlines()[-1] == "stopped"
    assert "Traceback" not in shown


def test_strangers_do_not_write_into_the_terminal(root: Path) -> None:
    with viewing(root, "--edit") as view:
        port = view.port
        for sent in (
            b"\x00\xff\r\n\r\n",
            b"GET / HTTP/1.1\r\nHost: \x1b[31m\r\n\r\n",
            b"GET /\x1b[31m HTTP/1.1\r\n\r\n",
            b"GET / HTTP/1.1\r\nHost: evil\r\nUpgrade: websocket\r\nConnection: upgrade\r\n\r\n",
            b"POST /api/edits HTTP/1.1\r\nContent-Length: 50\r\n\r\nabc",
            request(port).replace(b"GET", b"HEAD")[:-2]
            + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n",
        ):
            ask(port, sent)
        for _ in range(20):  # gone before they are answered, with a reset
            wire = socket.create_connection(("127.0.0.1", port))
            wire.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            wire.sendall(request(port) * 3)
            wire.close()
        assert ask(port, request(port)) == b"HTTP/1.1 200"
        shown = view.end()
    began = [line.split()[0] for line in shown.splitlines()[1:]]
    assert began == ["Anyone", "token", "Ctrl-C", "stopped"]


def mutated(requests: list[bytes], chance: random.Random) -> bytes:
    """Some of the requests, one after the other, with a few bytes changed, added or gone."""
    data = bytearray(b"".join(chance.choices(requests, k=chance.choice([1, 1, 2, 3]))))
    for _ in range(chance.randint(1, 6)):
        at = chance.randrange(len(data))
        match chance.randrange(4):
            case 0:
                data[at] = chance.randrange(256)
            case 1:
                data[at:at] = chance.choice(BITS)
            case 2:
                del data[at : at + chance.randint(1, 20)]
            case _:
                start = chance.randrange(len(data))
                data[at:at] = data[start : start + chance.randint(1, 60)]
        data = data or bytearray(b"x")
    return bytes(data)


BITS = [
    b"\r\n",
    b"\x00",
    b" ",
    b":",
    b"%00",
    b"%2e%2e",
    b"\xff",
    b"9" * 12,
    b"-1",
    b"\t",
    b"HTTP/1.0",
    b"Transfer-Encoding: chunked\r\n",
    b"Content-Length: 3\r\n",
    b"Expect: 100-continue\r\n",
    b"Upgrade: websocket\r\nConnection: upgrade\r\n",
]


def test_nor_do_hundreds_of_broken_requests(root: Path) -> None:
    chance = random.Random(5)
    with viewing(root, "--edit") as view:
        port, path = view.port, view.path
        token = path.partition("=")[2]
        write = f"Origin: http://localhost:{port}\r\nContent-Type: application/json\r\n"
        write += f"X-Walltopo-Token: {token}\r\nIf-Match: x\r\nContent-Length: 2\r\n\r\n{{}}"
        whole = [
            request(port),
            request(port, path),
            request(port).replace(b"GET", b"HEAD"),
            request(port)[:-2] + b"Transfer-Encoding: chunked\r\n\r\n2\r\nab\r\n0\r\n\r\n",
            request(port)[:-2] + b"Range: bytes=0-0,2-5,-3\r\nIf-None-Match: x\r\n\r\n",
            request(port, "/api/edits").replace(b"GET", b"POST")[:-2] + write.encode(),
        ]
        for _ in range(600):
            place = ("127.0.0.1", port)
            with suppress(OSError), socket.create_connection(place, timeout=PATIENCE_S) as wire:
                wire.sendall(mutated(whole, chance))
                wire.shutdown(socket.SHUT_WR)
                wire.recv(4096)
        assert ask(port, request(port)) == b"HTTP/1.1 200"
        shown = view.end()
    assert len(shown.splitlines()) == 5, shown


def test_a_defect_is_one_line_for_the_terminal_and_none_for_the_asker(root: Path) -> None:
    with viewing(root, "--edit") as view:
        port, path = view.port, view.path
        (root / "index.html").write_bytes(b"\xff")
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as wire:
            wire.sendall(request(port, path))
            answer = b"".join(iter(lambda: wire.recv(4096), b""))
        shown = view.end()
    assert answer.startswith(b"HTTP/1.1 500")
    assert answer.endswith(b"walltopo failed to answer\n")
    assert "a request failed: UnicodeDecodeError" in shown
    assert "Traceback" not in shown


def refused(root: Path, *given: str) -> int:
    """The exit code, whether the parser or the command refused."""
    try:
        return main(["view", str(root), *given])
    except SystemExit as error:
        return int(str(error.code))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["--port", "99999"], "65535"),
        (["--port", "-1"], "-1"),
        (["--host", "0.0.0.0"], "Give the one that others will open"),
        (["--host", "192.0.2.1", "--port", "0"], "not an address of this machine"),
        (["--embed", "gym"], "is not an origin"),
    ],
)
def test_addresses_that_cannot_be(
    root: Path, given: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refused(root, *given) == 2
    assert message in capsys.readouterr().err


def test_a_port_that_is_taken(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["view", str(root), "--port", port]) == 2
    assert f"port {port} is in use by another program" in capsys.readouterr().err


def test_a_port_of_the_system() -> None:
    lowest = int(Path("/proc/sys/net/ipv4/ip_unprivileged_port_start").read_text())
    if lowest <= 1:
        pytest.skip("here anybody may listen on any port")
    code = (
        "import os, encodings.idna; from walltopo.publish.server.address import listen; "
        "os.getuid() or os.setuid(65534); listen('127.0.0.1', 1)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "SettingsError: port 1 is reserved for system programs" in done.stderr
