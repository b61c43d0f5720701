"""Where the server listens, and the names under which it answers."""

from __future__ import annotations

import errno
import ipaddress
import re
import socket
from dataclasses import dataclass

from walltopo.core import SettingsError

LOOPBACK = ("127.0.0.1", "localhost", "::1")
_NAME = re.compile(r"[a-z0-9]([a-z0-9-]*[a-z0-9])?(\.[a-z0-9]([a-z0-9-]*[a-z0-9])?)*")
_ORIGIN = re.compile(r"https?://(\[[0-9a-f:.]+\]|[a-z0-9.-]+)(:[0-9]{1,5})?")


@dataclass(frozen=True)
class Address:
    """A name (or a number) and a port.

    Parameters
    ----------
    host : as a person writes it, an IPv6 number without brackets.
    port : 1 to 65535.
    """

    host: str
    port: int

    @property
    def local(self) -> bool:
        """Only this machine reaches it."""
        return self.host in LOOPBACK

    @property
    def url(self) -> str:
        """Of the page."""
        return f"http://{_bracketed(self.host)}:{self.port}/"

    @property
    def names(self) -> frozenset[str]:
        """What a request's `Host` may be; all else is a foreign name that leads here."""
        hosts = LOOPBACK if self.local else (self.host,)
        names = {f"{_bracketed(host)}:{self.port}" for host in hosts}
        if self.port == 80:  # browsers leave the default port out
            names |= {_bracketed(host) for host in hosts}
        return frozenset(names)


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def listen(host: str, port: int) -> tuple[socket.socket, Address]:
    """A socket that listens, and what to type to reach it.

    Parameters
    ----------
    host : the name or number under which others open the page; it is listened on just there.
    port : 0 takes any free one.

    Raises
    ------
    SettingsError : the host is none of this machine, or the port cannot be had.
    """
    if not 0 <= port <= 65535:
        raise SettingsError(f"--port {port}: expected 0 to 65535")
    host = _checked(host)
    try:
        family, _, _, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        found = socket.create_server((str(place[0]), port), family=family)
        # Inherited by what is accepted: else a body waits 40 ms for its head's acknowledgement.
        found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except OSError as error:
        raise _refused(host, port, error) from error
    return found, Address(host, int(found.getsockname()[1]))


def _checked(host: str) -> str:
    host = host.lower().strip("[]")
    try:
        number = ipaddress.ip_address(host)
    except ValueError:
        if not _NAME.fullmatch(host):
            raise SettingsError(f"--host {host!r} is neither a name nor a number") from None
        # `localhost` may lead to ::1, where another program of another user may listen.
        return "127.0.0.1" if host == "localhost" else host
    if number.is_unspecified:
        raise SettingsError(
            f"--host {host} is every address of this machine",
            "Give the one that others will open, such as 192.168.1.20.",
        )
    return str(number)


def _refused(host: str, port: int, error: OSError) -> SettingsError:
    """Why this address cannot be had."""
    other = "Choose another with --port (0: any free one)."
    if isinstance(error, socket.gaierror):
        return SettingsError(f"--host {host}: no such name in this network")
    if error.errno == errno.EADDRINUSE:
        return SettingsError(f"port {port} is in use by another program", other)
    if error.errno in (errno.EACCES, errno.EPERM):
        return SettingsError(f"port {port} is kept for programs of the system", other)
    if error.errno == errno.EADDRNOTAVAIL:
        return SettingsError(f"--host {host} is not an address of this machine")
    return SettingsError(f"cannot listen on {host} port {port}: {error.strerror}", other)


def check_origin(origin: str) -> str:
    """An origin that may go into a header.

    Raises
    ------
    SettingsError : it is more (or less) than scheme, host and port.
    """
    plain = origin.lower().removesuffix("/")
    if not _ORIGIN.fullmatch(plain):
        raise SettingsError(
            f"--embed {origin!r} is no origin", "Give scheme, host and port: https://gym.example"
        )
    return plain
