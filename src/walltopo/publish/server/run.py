"""The server as a whole: it listens, serves until Ctrl-C, and ends well."""

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
from walltopo.publish.server.guard import Rules
from walltopo.scans.folder import ScanFolder

KEEP_ALIVE_S = 5
MAX_CONNECTIONS = 64  # a browser opens six; more are answered with 503
END_S = 2  # for answers that are on their way at Ctrl-C
MOST_LINE = 16_000  # bytes of a request's head that h11 gathers


class Server(uvicorn.Server):
    """A scan's page; listens at once, serves while `run` runs.

    Parameters
    ----------
    port : 0 takes any free one.
    editor : the editor's routes; with them there is an edit mode, for those who have the token.
    close : called when the server has ended.
    host : see `listen`.
    embed : origins whose pages may show this one in a frame.
    tell : called with a line about each request that failed by a defect; from any thread.

    Raises
    ------
    SettingsError : address or origin cannot be used.
    """

    def __init__(
        self,
        scan_root: Path,
        port: int,
        host: str = "127.0.0.1",
        embed: Sequence[str] = (),
        tell: Callable[[str], None] | None = None,
        editor: Sequence[BaseRoute] = (),
        close: Callable[[], None] = lambda: None,
    ) -> None:
        origins = tuple(map(check_origin, embed))
        self.socket, self.address = listen(host, port)
        self.token = secrets.token_urlsafe(24) if editor else None
        self._close = close
        self.scan = ScanFolder(scan_root)
        app = make_app(self.scan, Rules(self.address.names, self.token, origins), editor, tell)
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
                # What strangers send is no news for the terminal; `tell` is for defects.
                log_config=None,
                log_level="critical",
                backlog=64,
                timeout_keep_alive=KEEP_ALIVE_S,
                timeout_graceful_shutdown=END_S,
                h11_max_incomplete_event_size=MOST_LINE,
            )
        )

    @property
    def url(self) -> str:
        """To open; in edit mode with the token."""
        return self.address.url + (f"?token={self.token}" if self.token else "")

    def notes(self) -> Iterator[str]:
        """Lines on who can do what at the address."""
        if self.token:
            yield "Whoever has this address can save edits into the scan folder; without the"
            yield f"token it shows the wall alone: {self.address.url}"
        if not self.address.local:
            yield "Everyone in this network can see the wall. Nothing is encrypted."

    def run(self, sockets: list[socket.socket] | None = None) -> None:
        """Serve until `should_exit`, Ctrl-C or SIGTERM."""
        try:
            super().run([*(sockets or []), self.socket])
        finally:
            self._close()

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """End well by a signal: uvicorn's own method raises the signal again afterwards.

        The watchdog of the command line, which hears of signals by the wakeup descriptor and ends
        the process after two seconds, is off meanwhile: open connections and a running rebuild
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
