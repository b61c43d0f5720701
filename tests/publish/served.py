"""A running server, and requests as no library would send them."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from walltopo.editing.http import editor_routes
from walltopo.editing.log_file import EditLogFile
from walltopo.editing.session import EditSession
from walltopo.pipeline.edit_session import open_session
from walltopo.publish.server.first_look import UnfinishedScan
from walltopo.publish.server.run import Server
from walltopo.scans.folder import ScanFolder

PATIENCE_S = 600  # a page may be rebuilt meanwhile, on a loaded machine


class StillSession(EditSession):
    """Saves, and rebuilds nothing."""

    def rebuild(self) -> None:
        pass


def still(scan: ScanFolder) -> EditSession:
    return StillSession(scan, EditLogFile(scan), open_session(scan)._rebuilder)


@contextmanager
def served(
    root: Path,
    edit: bool,
    embed: Sequence[str] = (),
    host: str = "127.0.0.1",
    opened: Callable[[ScanFolder], EditSession] = still,
    unfinished: UnfinishedScan | None = None,
) -> Iterator[Server]:
    """A server on a free port, as long as the block takes."""
    session = opened(ScanFolder(root)) if edit else None
    routes = editor_routes(session) if session else ()
    close = session.close if session else lambda: None
    server = Server(root, 0, host, embed, None, routes, close, unfinished)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.should_exit = True
        thread.join(PATIENCE_S)
        assert not thread.is_alive()


def connect(server: Server) -> socket.socket:
    """A bare connection."""
    return socket.create_connection((server.address.host, server.address.port), timeout=PATIENCE_S)


def talk(server: Server, *parts: bytes) -> bytes:
    """All that comes back until the other side closes; it may do so before it has all parts."""
    with connect(server) as wire:
        try:
            for part in parts:
                wire.sendall(part)
        except OSError:
            pass  # closed on us: what it said before counts
        return rest(wire)


def rest(wire: socket.socket) -> bytes:
    """Return what comes until the end of the connection."""
    shown = b""
    try:
        while part := wire.recv(65536):
            shown += part
    except ConnectionError:
        pass
    return shown


def head(method: str, path: str, **headers: str) -> bytes:
    """A request's head; `_` in names stands for `-`."""
    lines = [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    return "\r\n".join([f"{method} {path} HTTP/1.1", *lines, "", ""]).encode("latin-1")
