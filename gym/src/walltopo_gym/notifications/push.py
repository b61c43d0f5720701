"""Web push: one message to one browser through its vendor's push service (RFC 8030), encrypted for
that browser (RFC 8291) and signed by this server (RFC 8292)."""

from __future__ import annotations

import base64
import json
import time
from typing import Any, Final
from urllib.parse import urlsplit

from walltopo_gym.errors import NotFoundError, RequestError
from walltopo_gym.notifications.models import PushAddress
from walltopo_gym.outgoing import check_url, post

_DAY_S: Final = 86400
_KEY: Final = 65  # bytes of an uncompressed point of P-256
_SECRET: Final = 16
# The services keep 4096 bytes (RFC 8030, 7.2) of what is encrypted.
_MAX: Final = 3000


def check_address(endpoint: str, public_key: str, secret: str, *, private: bool) -> None:
    """Refuse an address that no message could be sent to.

    Raises
    ------
    RequestError : says why.
    """
    check_url(endpoint, private=private)
    try:
        from cryptography.hazmat.primitives.asymmetric.ec import (
            SECP256R1,
            EllipticCurvePublicKey,
        )

        EllipticCurvePublicKey.from_encoded_point(SECP256R1(), _bytes(public_key))
        is_right = len(_bytes(public_key)) == _KEY and len(_bytes(secret)) == _SECRET
    except ValueError:
        is_right = False
    if not is_right:
        raise RequestError("push-keys-wrong")


def push(
    address: PushAddress, body: dict[str, Any], key: str, sender: str, *, private: bool
) -> None:
    """Send a message.

    Parameters
    ----------
    body : "title", "text", "path" and "tag"; a browser shows the latest message per tag.
    key : this server's, PEM; sender : contact address for the push service.

    Raises
    ------
    NotFoundError : the subscription has ended; OSError : the service refused it.
    RequestError : the address lies in a private network.
    """
    import http_ece
    from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
    from py_vapid import Vapid02

    content = json.dumps(body).encode()[:_MAX]
    sealed = http_ece.encrypt(
        content,
        private_key=generate_private_key(SECP256R1()),
        dh=_bytes(address.public_key),
        auth_secret=_bytes(address.secret),
        version="aes128gcm",
    )
    parts = urlsplit(address.endpoint)
    claims = {
        "sub": f"mailto:{sender}",
        "aud": f"{parts.scheme}://{parts.netloc}",
        "exp": int(time.time()) + _DAY_S // 2,
    }
    headers = Vapid02.from_pem(key.encode()).sign(claims) | {
        "content-encoding": "aes128gcm",
        "content-type": "application/octet-stream",
        "ttl": str(_DAY_S),
        "urgency": "normal",
    }
    status = post(address.endpoint, sealed, headers, private=private)
    if status in (404, 410):
        raise NotFoundError("push-gone")
    if not 200 <= status < 300:
        raise OSError(f"answered {status}")


def _bytes(text: str) -> bytes:
    return base64.urlsafe_b64decode(text + "=" * (-len(text) % 4))
