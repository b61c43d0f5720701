"""One message to an address of somebody's choice: signed, and into no network of ours.

Signed by Standard Webhooks (https://www.standardwebhooks.com, 1.0): `webhook-id`,
`webhook-timestamp` and `webhook-signature`, an HMAC-SHA256 over all three parts. The host's name is
looked up once, each of its addresses must be a public one, and the connection goes to the one that
was looked at: a name that means something else a moment later does not help (OWASP, Server-Side
Request Forgery Prevention). Redirects are not followed.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import secrets
import socket
import ssl
import threading
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address
from typing import Any, Final
from urllib.parse import urlsplit
from uuid import UUID

from walltopo.core import InputError

_PREFIX: Final = "whsec_"
# Their last 32 bits are an IPv4 address: NAT64 (RFC 6052), IPv4-compatible (RFC 4291) and
# IPv4-translated (RFC 2765).
_CARRYING: Final = tuple(map(IPv6Network, ("64:ff9b::/96", "::/96", "::ffff:0:0:0/96")))
_LOCAL_NAT64: Final = IPv6Network("64:ff9b:1::/48")  # RFC 8215
_LONGEST_NAME: Final = 253  # characters (RFC 1035, 2.3.4)
_PATIENCE_S: Final = 10  # for a connection, and between two pieces of an answer
_DEADLINE_S: Final = 15  # for a whole exchange


def new_signing_secret() -> str:
    """A secret in the standard's spelling."""
    return _PREFIX + base64.b64encode(secrets.token_bytes(32)).decode()


def signature(secret: str, message: UUID, at: int, body: bytes) -> str:
    """The header `webhook-signature`."""
    key = base64.b64decode(secret.removeprefix(_PREFIX))
    signed = b".".join([str(message).encode(), str(at).encode(), body])
    return "v1," + base64.b64encode(hmac.digest(key, signed, hashlib.sha256)).decode()


def check_url(url: str, *, private: bool) -> None:
    """Refuse an address that nothing would ever be sent to.

    Parameters
    ----------
    private : addresses of our own networks and plain HTTP will do, too.

    Raises
    ------
    InputError : says why not.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise InputError(f"no address: {error}") from error
    if parts.scheme not in (("https", "http") if private else ("https",)) or not host:
        raise InputError("a webhook's address begins with https://")
    if parts.username or parts.password or port == 0:
        raise InputError("a webhook's address has a host, a port and a path, no more")
    try:
        address = ip_address(host)
    except ValueError:  # a name, looked up when something is sent
        _check_name(host)
        return
    if not private:
        _refuse_private(str(address))


def _check_name(host: str) -> None:
    """Refuse a name that no name server can be asked for.

    Raises
    ------
    InputError : a part of it is empty or has more than 63 characters, or all of it more than 253.
    """
    try:
        spelled = host.rstrip(".").encode("idna")
    except UnicodeError as error:
        raise InputError("no address: a part of the host's name is empty or too long") from error
    if len(spelled) > _LONGEST_NAME:
        raise InputError("no address: the host's name is too long")


def send(
    url: str, secret: str, message: UUID, at: int, body: dict[str, Any], *, private: bool
) -> None:
    """Send one message; it is taken when the answer's status is 2xx.

    Raises
    ------
    InputError : the address is none, or one of our own networks; OSError : it was not taken.
    """
    content = json.dumps(body).encode()
    headers = {
        "content-type": "application/json",
        "webhook-id": str(message),
        "webhook-timestamp": str(at),
        "webhook-signature": signature(secret, message, at, content),
    }
    status = post(url, content, headers, private=private)
    if not 200 <= status < 300:
        raise OSError(f"answered {status}")


def post(url: str, content: bytes, headers: Mapping[str, str], *, private: bool) -> int:
    """Send bytes to somebody's address; the status of the answer.

    Raises
    ------
    InputError : the address is none, or one of our own networks; OSError : nothing came back.
    """
    check_url(url, private=private)
    parts = urlsplit(url)
    assert parts.hostname is not None
    port = parts.port or (443 if parts.scheme == "https" else 80)
    found = socket.getaddrinfo(parts.hostname, port, type=socket.SOCK_STREAM)
    if not private:
        for entry in found:
            _refuse_private(str(entry[4][0]))
    stream = socket.create_connection((str(found[0][4][0]), port), _PATIENCE_S)
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    with closing(stream), _cut_after(stream, _DEADLINE_S):
        connection = _connection(parts.scheme, parts.hostname, port, stream)
        try:
            connection.request("POST", path, content, {"user-agent": "walltopo-gym", **headers})
            status = connection.getresponse().status
        except HTTPException as error:
            raise OSError(f"no HTTP came back ({error})") from error
        finally:
            connection.close()
    return status


@contextmanager
def _cut_after(stream: socket.socket, seconds: float) -> Iterator[None]:
    """Cut a connection off after so long, however little and often the other side sends.

    Raises
    ------
    OSError : it was cut off.
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
    for one in (found, *_carried(found)):
        is_mapped = one is found and getattr(found, "ipv4_mapped", None) is not None
        is_public = one.is_global and not one.is_multicast and one not in _LOCAL_NAT64
        if not is_mapped and not is_public:
            raise InputError(f"{found} is no public address", "The operator can allow it.")


def _carried(address: IPv4Address | IPv6Address) -> list[IPv4Address]:
    """Return the IPv4 addresses to which a translator would send what goes to an IPv6 address."""
    if isinstance(address, IPv4Address):
        return []
    carried = [address.ipv4_mapped, address.sixtofour, *(address.teredo or ())]
    if any(address in network for network in _CARRYING):
        carried.append(IPv4Address(int(address) & 0xFFFFFFFF))
    return [one for one in carried if one is not None]


def _connection(scheme: str, host: str, port: int, stream: socket.socket) -> HTTPConnection:
    """Over this stream, whatever the name means by now; the certificate is the name's."""
    if scheme == "https":
        connection: HTTPConnection = HTTPSConnection(host, port, timeout=_PATIENCE_S)
        connection.sock = ssl.create_default_context().wrap_socket(stream, server_hostname=host)
    else:
        connection = HTTPConnection(host, port, timeout=_PATIENCE_S)
        connection.sock = stream
    return connection
