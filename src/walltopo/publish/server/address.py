"""The address of the server, and the host names under which it answers."""

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
    """A host name (or IP address) and a port.

    Parameters
    ----------
    host : as a person writes it, an IPv6 address without brackets.
    port : 1 to 65535.
    """

    host: str
    port: int

    @property
    def local(self) -> bool:
        """Return whether only this machine can reach the address."""
        return self.host in LOOPBACK

    @property
    def url(self) -> str:
        """Return the URL of the page."""
        return f"http://{_bracketed(self.host)}:{self.port}/"

    @property
    def names(self) -> frozenset[str]:
        """Return the allowed values of a request's `Host`; others are foreign names for us."""
        hosts = LOOPBACK if self.local else (self.host,)
        names = {f"{_bracketed(host)}:{self.port}" for host in hosts}
        if self.port == 80:  # browsers omit the default port
            names |= {_bracketed(host) for host in hosts}
        return frozenset(names)


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def listen(host: str, port: int) -> tuple[socket.socket, Address]:
    """Return a listening socket, and the address at which it can be reached.

    Parameters
    ----------
    host : name or IP address under which others open the page; the socket listens on it only.
    port : 0 takes any free one.

    Raises
    ------
    SettingsError : the host does not belong to this machine, or the port is not available.
    """
    if not 0 <= port <= 65535:
        raise SettingsError(f"--port {port}: expected 0 to 65535")
    host = _checked(host)
    try:
        family, _, _, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        found = socket.create_server((str(place[0]), port), family=family)
        # Accepted sockets inherit this; else a body waits 40 ms for its head's acknowledgement.
        found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except OSError as error:
        raise _unavailable_error(host, port, error) from error
    return found, Address(host, int(found.getsockname()[1]))


def _checked(host: str) -> str:
    host = host.lower().strip("[]")
    try:
        number = ipaddress.ip_address(host)
    except ValueError:
        if not _NAME.fullmatch(host):
            raise SettingsError(f"--host {host!r} is neither a name nor an address") from None
        # `localhost` may resolve to ::1, where a program of another user may listen.
        return "127.0.0.1" if host == "localhost" else host
    if number.is_unspecified:
        raise SettingsError(
            f"--host {host} is every address of this machine",
            "Give the one that others will open, such as 192.168.1.20.",
        )
    return str(number)


def _unavailable_error(host: str, port: int, error: OSError) -> SettingsError:
    """Return an error that explains why the address is not available."""
    other = "Choose another with --port (0: any free one)."
    if isinstance(error, socket.gaierror):
        return SettingsError(f"--host {host}: the name does not exist in this network")
    if error.errno == errno.EADDRINUSE:
        return SettingsError(f"port {port} is in use by another program", other)
    if error.errno in (errno.EACCES, errno.EPERM):
        return SettingsError(f"port {port} is reserved for system programs", other)
    if error.errno == errno.EADDRNOTAVAIL:
        return SettingsError(f"--host {host} is not an address of this machine")
    return SettingsError(f"cannot listen on {host} port {port}: {error.strerror}", other)


def check_origin(origin: str) -> str:
    """Return an origin that is valid in a header.

    Raises
    ------
    SettingsError : the origin is not exactly scheme, host and port.
    """
    plain = origin.lower().removesuffix("/")
    if not _ORIGIN.fullmatch(plain):
        raise SettingsError(
            f"--embed {origin!r} is not an origin",
            "Give scheme, host and port: https://gym.example",
        )
    return plain
