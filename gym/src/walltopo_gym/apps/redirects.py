"""Redirect addresses of apps: which may be registered, and which match a registered one."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final
from urllib.parse import urlsplit

from walltopo_gym.errors import RequestError

# Letters of an address (RFC 3986) without `#`: browsers read others, such as `\`, in their own way.
_LETTERS: Final = re.compile(r"[A-Za-z0-9\-._~:/?\[\]@!$&'()*+,;=%]+")
# Programs on a device listen on whatever port is free (RFC 8252, 7.3).
_LOOPBACK: Final = re.compile(r"http://(127\.0\.0\.1|\[::1\])(?::[0-9]{1,5})?((?:[/?].*)?)")
_OWN_DEVICE: Final = {"localhost", "127.0.0.1", "::1"}


def check_redirect(address: str) -> None:
    """Refuse an address that must not get codes.

    Raises
    ------
    RequestError : it is not https, not http on the person's own device, and has no scheme of the
        app's own domain turned round (RFC 8252, 7.1).
    """
    if not _LETTERS.fullmatch(address) or not _is_safe(address):
        raise RequestError("app-redirect", "app-redirect-hint", address=address)


def _is_safe(address: str) -> bool:
    try:
        parts = urlsplit(address)
        host, _ = parts.hostname, parts.port
    except ValueError:
        return False
    if "@" in parts.netloc:
        return False
    if parts.scheme == "https":
        return bool(host)
    if parts.scheme == "http":
        return host in _OWN_DEVICE
    return "." in parts.scheme


def is_registered(address: str, registered: Iterable[str]) -> bool:
    """Return whether an address is a registered one, letter by letter; the port of the person's
    own device is free."""
    if not _LETTERS.fullmatch(address):
        return False
    key = _loopback_key(address)
    return any(
        address == known or (key is not None and key == _loopback_key(known))
        for known in registered
    )


def _loopback_key(address: str) -> tuple[str, str] | None:
    found = _LOOPBACK.fullmatch(address)
    return None if found is None else (found[1], found[2])


def shown_target(address: str) -> str:
    """Return what a person recognises of a redirect address: its host, or its own scheme."""
    parts = urlsplit(address)
    return parts.netloc if parts.scheme in ("http", "https") else f"{parts.scheme}:"
