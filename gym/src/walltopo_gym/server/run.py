"""Serving the application with uvicorn."""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable
from contextlib import closing, nullcontext
from functools import partial

import uvicorn

from walltopo.core import EnvironmentLacksError
from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.api.services import Services
from walltopo_gym.migrations.run import migrate
from walltopo_gym.operating.replacement import finish_switch
from walltopo_gym.operating.restoration import Restoration, WantedRestoration, carry_out
from walltopo_gym.operating.setup import Setup, drop_upload, is_empty
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.scans.receiving import finish_all
from walltopo_gym.server.app import build_app, open_services
from walltopo_gym.server.maintenance import in_maintenance
from walltopo_gym.server.request_log import log_config
from walltopo_gym.settings import GymSettings
from walltopo_gym.work import at_work

_LOG = logging.getLogger("walltopo_gym.server")
_KEPT_S = 60  # an idle connection; longer than clients keep theirs: none meets a closed one
_LAST_WORDS_S = 10  # requests in progress when the server stops


def serve(settings: GymSettings, tell: Callable[[str], None]) -> None:
    """Serve until a signal arrives.

    Parameters
    ----------
    tell : receives the address once the server listens on it.

    Raises
    ------
    EnvironmentLacksError : the address cannot be listened on.
    """
    listener = _bind_socket(settings)
    host, port = listener.getsockname()[:2]
    address, (code, _) = f"http://{host}:{port}", new_secret()
    with closing(listener):
        finish_switch(settings)
        drop_upload(settings)
        wanted = _serve_until_stopped(settings, listener, code, partial(tell, address))
        while wanted is not None:
            with in_maintenance(listener):
                carry_out(settings, wanted)
            wanted = _serve_until_stopped(settings, listener, code, _tell_nothing)


def _tell_nothing() -> None:
    """Tell nothing: the address is known."""


def _serve_until_stopped(
    settings: GymSettings, listener: socket.socket, code: str, ready: Callable[[], None]
) -> WantedRestoration | None:
    """Serve until a signal arrives, or until somebody wants a backup to be restored.

    Parameters
    ----------
    code : of `Setup`, if the server is empty. ready : called once the server listens.

    Returns
    -------
    wanted : that restoration; None after a signal.
    """
    services = open_services(settings)
    try:
        migrate(services.database)
        finish_all(services.database, services.store, services.get(Incoming))
        config = uvicorn.Config(
            build_app(services),
            server_header=False,
            log_config=log_config(settings.log),
            access_log=False,  # ours has ids, and no queries
            proxy_headers=bool(settings.proxies),
            forwarded_allow_ips=list(settings.proxies),
            timeout_graceful_shutdown=_LAST_WORDS_S,
            timeout_keep_alive=_KEPT_S,
        )
        server = uvicorn.Server(config)
        restoration = services.get(Restoration)
        restoration.stop = partial(setattr, server, "should_exit", True)
        ready()
        _offer_setup(services, code)
        resources = services.settings, services.database, services.store
        # Without workers here the scans are left to `walltopo gym worker`.
        with at_work(*resources) if settings.workers else nullcontext():
            server.run(sockets=[listener.dup()])  # uvicorn closes it
        return restoration.wanted
    finally:
        services.close()


def _offer_setup(services: Services, code: str) -> None:
    """Log the code of an empty server, by which a browser can restore a backup."""
    with services.database.reading() as session:
        if not is_empty(session):
            return
    services.get(Setup).open(code)
    link = f"{services.settings.link_base}/setup#{code}"
    _LOG.warning("this server is empty; restore a backup: %s", link)


def _bind_socket(settings: GymSettings) -> socket.socket:
    """Bind the socket here, so that port 0 is resolved and a used port gives a clear error."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    # Head and body of an answer are two writes: the second would wait 40 ms for the first one's
    # acknowledgement. Accepted sockets inherit it; asyncio sets it on sockets of its own only.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    try:
        listener.bind((settings.host, settings.port))
        listener.listen()  # who comes before uvicorn is ready waits
    except OSError as error:
        listener.close()
        raise EnvironmentLacksError(
            f"cannot listen on {settings.host}:{settings.port} ({error.strerror})",
            "Give another --port.",
        ) from error
    return listener
