"""The local server: listen, serve until Ctrl-C, and shut down gracefully."""

from __future__ import annotations

import secrets
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import uvicorn
from starlette.routing import BaseRoute

from walltopo.publish.server.address import check_origin, listen
from walltopo.publish.server.app import make_app
from walltopo.publish.server.first_look import UnfinishedScan
from walltopo.publish.server.guard import Rules
from walltopo.scans.folder import ScanFolder

KEEP_ALIVE_S = 5
MAX_CONNECTIONS = 64  # a browser opens six; further ones get status 503
SHUTDOWN_S = 2  # for responses in progress at Ctrl-C
MAX_LINE = 16_000  # bytes of a request's head that h11 buffers


class Server(uvicorn.Server):
    """The server of a scan's page; it listens on creation and serves during `run`.

    Parameters
    ----------
    port : 0 takes any free one.
    editor : the editor's routes; if there are any, edit mode is on and needs the token.
    close : called when the server has ended.
    unfinished : the scan while it runs, which is shown until its page is there.
    host : see `listen`.
    embed : origins whose pages may embed this one in a frame.
    on_defect : called, from any thread, with a line about each request that failed by a defect.

    Raises
    ------
    SettingsError : the address or an origin is unusable.
    """

    def __init__(
        self,
        scan_root: Path,
        port: int,
        host: str = "127.0.0.1",
        embed: Sequence[str] = (),
        on_defect: Callable[[str], None] | None = None,
        editor: Sequence[BaseRoute] = (),
        close: Callable[[], None] = lambda: None,
        unfinished: UnfinishedScan | None = None,
    ) -> None:
        origins = tuple(map(check_origin, embed))
        self.socket, self.address = listen(host, port)
        self.token = secrets.token_urlsafe(24) if editor else None
        self._close = close
        self.scan = ScanFolder(scan_root)
        rules = Rules(self.address.names, self.token, origins)
        app = make_app(self.scan, rules, editor, on_defect, unfinished)
        super().__init__(
            uvicorn.Config(
                app,
                loop="asyncio",
                http="h11",
                limit_concurrency=MAX_CONNECTIONS,
                ws="none",
                lifespan="off",
                proxy_headers=False,
                server_header=False,
                access_log=False,
                # Requests of strangers are not logged in the terminal; `on_defect` reports defects.
                log_config=None,
                log_level="critical",
                backlog=64,
                timeout_keep_alive=KEEP_ALIVE_S,
                timeout_graceful_shutdown=SHUTDOWN_S,
                h11_max_incomplete_event_size=MAX_LINE,
            )
        )

    @property
    def url(self) -> str:
        """Return the URL to open; in edit mode with the token."""
        return self.address.url + (f"?token={self.token}" if self.token else "")

    def notes(self) -> Iterator[str]:
        """Yield lines that warn of the access that the address grants."""
        if self.token:
            yield "Anyone with this address can save edits into the scan folder; without the"
            yield f"token it only shows the wall: {self.address.url}"
        if not self.address.local:
            yield "Everyone in this network can see the wall. The connection is not encrypted."

    def run(self, sockets: list[socket.socket] | None = None) -> None:
        """Serve until `should_exit`, Ctrl-C or SIGTERM."""
        try:
            super().run([*(sockets or []), self.socket])
        finally:
            self._close()

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Shut down gracefully on a signal: uvicorn's own method raises the signal again.

        Meanwhile the watchdog of the command line is off, which learns of signals by the wakeup
        descriptor and ends the process after two seconds: open connections and a running rebuild
        may take longer.
        """
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        caught = (signal.SIGINT, signal.SIGTERM)
        before = {number: signal.signal(number, self.handle_exit) for number in caught}
        woken = signal.set_wakeup_fd(-1)
        try:
            yield
        finally:
            signal.set_wakeup_fd(woken)
            for number, handler in before.items():
                signal.signal(number, handler)
