"""Many and broken connections: others are served, and the machine keeps its share."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from served import connect, head, served, talk  # type: ignore[import-not-found]

from walltopo.publish.server.run import MAX_CONNECTIONS, Server
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]
LARGE = 40_000_000  # bytes: more than the system keeps for a connection


@pytest.fixture
def scan(make_scan: MakeScan) -> ScanFolder:
    made = make_scan(cells=20)
    made.page.write_text("<wall-topo src=x></wall-topo>")
    (made.root / "page").mkdir()
    with (made.root / "page" / "detail.glb").open("wb") as stream:
        stream.truncate(LARGE)
    return made


@pytest.fixture
def server(scan: ScanFolder) -> Iterator[Server]:
    with served(scan.root, edit=True) as running:
        yield running


def own(server: Server) -> str:
    return f"127.0.0.1:{server.address.port}"


def whole_page(server: Server) -> bytes:
    shown: bytes = talk(server, head("GET", "/", Host=own(server), Connection="close"))
    return shown


def until(holds: Callable[[], bool]) -> None:
    """Wait for a condition; what never comes is a failure."""
    pause = threading.Event()
    deadline = time.monotonic() + 600
    while not holds():
        assert time.monotonic() < deadline, "it does not come"
        pause.wait(0.02)


def open_files(name: str) -> list[Path]:
    """Return the open files of this process that have a name."""
    found = (Path(f"/proc/self/fd/{one}") for one in os.listdir("/proc/self/fd"))
    return [one for one in found if one.exists() and one.resolve().name == name]


def test_connections_above_the_limit_are_refused_until_others_end(server: Server) -> None:
    wires: list[socket.socket] = []
    try:
        for _ in range(MAX_CONNECTIONS):
            wires.append(connect(server))
        until(lambda: len(server.server_state.connections) >= MAX_CONNECTIONS)
        assert whole_page(server).startswith(b"HTTP/1.1 503")
    finally:
        for wire in wires:
            wire.close()
    until(lambda: not server.server_state.connections)
    assert whole_page(server).startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize(
    "sent",
    [
        b"GET / HTTP/1.1\r\nX: " + b"x" * 1_000_000,
        b"GET /" + b"x" * 20_000 + b" HTTP/1.1\r\nHost: HOST\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: HOST\r\n" + b"X: y\r\n" * 3000 + b"\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01",
        b"\r\n\r\n\x00\x00\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: HOST\r\nTransfer-Encoding: chunked, chunked\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost : HOST\r\n\r\n",
        b"GET /\xff HTTP/1.1\r\nHost: HOST\r\n\r\n",
    ],
)
def test_what_is_no_request_is_refused_and_closed(server: Server, sent: bytes) -> None:
    shown = talk(server, sent.replace(b"HOST", own(server).encode()))
    assert not shown or int(shown.split()[1]) in (400, 404, 431, 501)
    assert shown.count(b"HTTP/1.1 ") <= 1
    assert whole_page(server).startswith(b"HTTP/1.1 200")


def test_who_goes_in_the_middle_leaves_nothing_behind(server: Server, scan: ScanFolder) -> None:
    requests = head("GET", "/page/detail.glb", Host=own(server))
    for k in range(40):
        with connect(server) as wire:
            wire.sendall(requests[: 10 + k] if k % 2 else requests)
            if not k % 2:
                wire.recv(1000)
    assert whole_page(server).startswith(b"HTTP/1.1 200")
    until(lambda: not server.server_state.tasks and not open_files("detail.glb"))
