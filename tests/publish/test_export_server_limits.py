"""Slow, many and broken connections: others are served, and the machine keeps its share."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from served import connect, head, rest, served, talk  # type: ignore[import-not-found]

from walltopo.publish.server import connections
from walltopo.publish.server.run import Server
from walltopo.scan.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]
SLOW = 400
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
    said: bytes = talk(server, head("GET", "/", Host=own(server), Connection="close"))
    return said


def until(holds: Callable[[], bool]) -> None:
    """Wait for a condition; what never comes is a failure."""
    pause = threading.Event()
    for _ in range(3000):
        if holds():
            return
        pause.wait(0.02)
    pytest.fail("it does not come")


BEGUN = {
    "nothing": b"",
    "half a head": b"GET / HTTP/1.1\r\nHost: loc",
    "half a body": b"POST /api/edits HTTP/1.1\r\nHost: HOST\r\nOrigin: http://HOST\r\n"
    b"Content-Type: application/json\r\nX-Walltopo-Token: TOKEN\r\nIf-Match: x\r\n"
    b"Content-Length: 1000\r\n\r\n{",
    "an answer not taken": b"GET /page/detail.glb HTTP/1.1\r\nHost: HOST\r\n\r\n",
}


@pytest.mark.parametrize("kind", BEGUN)
def test_slow_connections_do_not_keep_others_out(server: Server, kind: str) -> None:
    begun = BEGUN[kind].replace(b"HOST", own(server).encode())
    begun = begun.replace(b"TOKEN", str(server.token).encode())
    assert whole_page(server).startswith(b"HTTP/1.1 200")
    files, threads = len(os.listdir("/proc/self/fd")), threading.active_count()
    wires: list[socket.socket] = []
    try:
        for _ in range(SLOW):
            wires.append(connect(server))
            wires[-1].sendall(begun)
        assert whole_page(server).startswith(b"HTTP/1.1 200")
        assert len(server.server_state.connections) <= connections.MOST
        until(lambda: len(server.server_state.tasks) <= connections.MOST)
        # Ours are open as well; the server has a connection and at most a file for each of its.
        assert len(os.listdir("/proc/self/fd")) <= files + SLOW + 2 * connections.MOST + 20
        assert threading.active_count() <= threads + 40
    finally:
        for wire in wires:
            wire.close()


@pytest.mark.parametrize("kind", BEGUN)
def test_what_does_not_go_on_is_ended(
    scan: ScanFolder, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "ARRIVE_S", 0.3)
    monkeypatch.setattr(connections, "FETCH_S", 0.3)
    dropped = threading.Event()
    drop = connections.Connection._drop

    def told(self: connections.Connection) -> None:
        drop(self)
        dropped.set()

    monkeypatch.setattr(connections.Connection, "_drop", told)
    with served(scan.root, edit=True) as server, connect(server) as wire:
        begun = BEGUN[kind].replace(b"HOST", own(server).encode())
        wire.sendall(begun.replace(b"TOKEN", str(server.token).encode()))
        assert dropped.wait(60)
        assert len(rest(wire)) < LARGE


def test_a_byte_now_and_then_does_not_wind_the_clock_up(
    scan: ScanFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "ARRIVE_S", 0.5)
    with served(scan.root, edit=True) as server, connect(server) as wire:
        wire.settimeout(0.05)
        for letter in b"GET / HTTP/1.1\r\nX: " + b"x" * 1000:
            try:
                wire.sendall(bytes([letter]))
                if not wire.recv(1):
                    break
            except TimeoutError:
                continue
            except ConnectionError:
                break
        else:
            pytest.fail("it could go on for ever")


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
    said = talk(server, sent.replace(b"HOST", own(server).encode()))
    assert not said or int(said.split()[1]) in (400, 404, 431, 501)
    assert said.count(b"HTTP/1.1 ") <= 1
    assert whole_page(server).startswith(b"HTTP/1.1 200")


def test_who_goes_in_the_middle_leaves_nothing_behind(server: Server, scan: ScanFolder) -> None:
    asked = head("GET", "/page/detail.glb", Host=own(server))
    for k in range(40):
        with connect(server) as wire:
            wire.sendall(asked[: 10 + k] if k % 2 else asked)
            if not k % 2:
                wire.recv(1000)
    assert whole_page(server).startswith(b"HTTP/1.1 200")
    until(lambda: not server.server_state.tasks)
    names = (Path(f"/proc/self/fd/{one}") for one in os.listdir("/proc/self/fd"))
    assert not [one for one in names if one.exists() and one.resolve().name == "detail.glb"]
