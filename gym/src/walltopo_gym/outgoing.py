"""Requests to hosts that strangers name: public addresses alone, and an end to each exchange."""

from __future__ import annotations

import socket
import ssl
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import Future
from contextlib import closing, contextmanager, suppress
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address
from typing import Final
from urllib.parse import urlsplit

from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.domains import ascii_domain, ascii_url
from walltopo_gym.errors import RequestError

# Their last 32 bits are an IPv4 address: NAT64 (RFC 6052), IPv4-compatible (RFC 4291) and
# IPv4-translated (RFC 2765).
_CARRYING: Final = tuple(map(IPv6Network, ("64:ff9b::/96", "::/96", "::ffff:0:0:0/96")))

_LOCAL_NAT64: Final = IPv6Network("64:ff9b:1::/48")  # RFC 8215

_LONGEST_NAME: Final = 253  # characters (RFC 1035, 2.3.4)

_PATIENCE_S: Final = 10  # for a name, a connection, and between two pieces of an answer

_DEADLINE_S: Final = 15  # for a whole exchange


def check_url(url: str, *, private: bool) -> None:
    """Refuse an address that no message could be sent to.

    Parameters
    ----------
    private : also accept private networks and plain HTTP.

    Raises
    ------
    RequestError : says why.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise RequestError("webhook-no-address", why=error) from error
    if parts.scheme not in (("https", "http") if private else ("https",)) or not host:
        raise RequestError("webhook-https")
    if parts.username or parts.password or port == 0:
        raise RequestError("webhook-parts")
    try:
        address = ip_address(host)
    except ValueError:  # a name, looked up when something is sent
        _check_name(host)
        return
    if not private:
        _refuse_private(str(address))


def _check_name(host: str) -> None:
    """Refuse a host name that the DNS cannot have.

    Raises
    ------
    RequestError : a label is empty or longer than 63 characters, or the name longer than 253.
    """
    try:
        spelled = ascii_domain(host.rstrip(".")).encode("idna")
    except ValueError as error:  # UnicodeError is one
        raise RequestError("webhook-host-part") from error
    if len(spelled) > _LONGEST_NAME:
        raise RequestError("webhook-host-long")


def post(url: str, content: bytes, headers: Mapping[str, str], *, private: bool) -> int:
    """Post bytes to an address and return the status.

    Raises
    ------
    RequestError : the address is invalid or lies in a private network; OSError : no response.
    """
    check_url(url, private=private)
    parts = urlsplit(ascii_url(url))
    assert parts.hostname is not None
    port = parts.port or (443 if parts.scheme == "https" else 80)
    addresses = _resolve_host(parts.hostname, port)
    if not private:
        for address in addresses:
            _refuse_private(address)
    check_unlocked("another machine is called")
    stream = socket.create_connection((addresses[0], port), _PATIENCE_S)
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    with closing(stream), _deadline_for(stream, _DEADLINE_S):
        connection = _open_connection(parts.scheme, parts.hostname, port, stream)
        try:
            connection.request("POST", path, content, {"user-agent": "walltopo-gym", **headers})
            status = connection.getresponse().status
        except HTTPException as error:
            raise OSError(f"no HTTP came back ({error})") from error
        finally:
            connection.close()
    return status


def _resolve_host(host: str, port: int) -> list[str]:
    """Return the addresses of a host. The system's resolver has no timeout, so a thread calls it.

    Raises
    ------
    OSError : the name has no address, or the resolver does not respond within the deadline.
    """
    found: Future[list[str]] = Future()

    def look_up() -> None:
        try:
            entries = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
            found.set_result([str(entry[4][0]) for entry in entries])
        except Exception as error:
            found.set_exception(error)

    threading.Thread(target=look_up, name=f"resolve {host}", daemon=True).start()
    try:
        return found.result(_PATIENCE_S)
    except TimeoutError as error:
        raise OSError(f"the name {host} was not resolved within {_PATIENCE_S:g} s") from error


@contextmanager
def _deadline_for(stream: socket.socket, seconds: float) -> Iterator[None]:
    """Close a connection after a deadline, however slowly the other side keeps sending.

    Raises
    ------
    OSError : it was closed.
    """
    cut = threading.Event()
    handle = stream.dup()  # TLS takes the stream itself over

    def cut_off() -> None:
        cut.set()
        with suppress(OSError):
            handle.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(seconds, cut_off)
    timer.start()
    try:
        yield
    except OSError as error:
        if not cut.is_set():
            raise
        raise OSError(f"no whole answer within {seconds} s") from error
    finally:
        timer.cancel()
        timer.join()
        handle.close()
    if cut.is_set():  # an answer that was cut off in its head can look like a whole one
        raise OSError(f"no whole answer within {seconds} s")


def _refuse_private(address: str) -> None:
    found = ip_address(address.partition("%")[0])
    for one in (found, *_embedded_addresses(found)):
        is_mapped = one is found and getattr(found, "ipv4_mapped", None) is not None
        is_public = one.is_global and not one.is_multicast and one not in _LOCAL_NAT64
        if not is_mapped and not is_public:
            raise RequestError("webhook-not-public", "webhook-operator", address=found)


def _embedded_addresses(address: IPv4Address | IPv6Address) -> list[IPv4Address]:
    """Return the IPv4 addresses to which a translator would send packets for an IPv6 address."""
    if isinstance(address, IPv4Address):
        return []
    carried = [address.ipv4_mapped, address.sixtofour, *(address.teredo or ())]
    if any(address in network for network in _CARRYING):
        carried.append(IPv4Address(int(address) & 0xFFFFFFFF))
    return [one for one in carried if one is not None]


def _open_connection(scheme: str, host: str, port: int, stream: socket.socket) -> HTTPConnection:
    """Return a connection over this stream, whatever the name resolves to by now; the certificate
    must match the name."""
    if scheme == "https":
        connection: HTTPConnection = HTTPSConnection(host, port, timeout=_PATIENCE_S)
        connection.sock = ssl.create_default_context().wrap_socket(stream, server_hostname=host)
    else:
        connection = HTTPConnection(host, port, timeout=_PATIENCE_S)
        connection.sock = stream
    return connection
