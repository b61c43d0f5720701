"""The parts of tus 1.0.0 (https://tus.io/protocols/resumable-upload) that all uploads share: the
version, the metadata, and the body.

A phone announces a file (POST) and sends it (PATCH); after an interruption it asks for the offset
(HEAD) and resumes. `Upload-Metadata` has `filename` and, if the phone can compute it, `sha256`.
"""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable
from typing import IO, Annotated, Any, Final

from anyio import to_thread
from fastapi import Depends, Header, HTTPException, Request, Response
from starlette.requests import ClientDisconnect

from walltopo_gym.errors import RequestError

CONTENT_TYPE: Final = "application/offset+octet-stream"
_VERSION: Final = "1.0.0"
_PIECE: Final = 1 << 20


def speak_tus(response: Response, tus_resumable: Annotated[str | None, Header()] = None) -> None:
    """Check the tus version of a request, and set it in the response."""
    response.headers["tus-resumable"] = _VERSION
    if tus_resumable != _VERSION:
        raise HTTPException(
            412,
            f"Tus-Resumable: expected {_VERSION}, got {tus_resumable}",
            {"tus-version": _VERSION},
        )


Tus: Final[Any] = Depends(speak_tus)


def check_content_type(content_type: str) -> None:
    """Refuse the body of a PATCH that is not a piece of a file."""
    if content_type != CONTENT_TYPE:
        raise HTTPException(415, f"Content-Type: expected {CONTENT_TYPE}")


async def write_body(
    request: Request, check_room: Callable[[int], None], stream: IO[bytes], most: int
) -> None:
    """Write the body to disk as it arrives. A broken connection keeps what arrived before.

    Parameters
    ----------
    check_room : refuses a number of bytes for which the disk is too full.

    Raises
    ------
    UnavailableError : the disk is too full; what arrived before is kept.
    """
    held = bytearray()

    def write(piece: bytes) -> None:
        for start in range(0, len(piece), _PIECE):
            part = piece[start : start + _PIECE]
            check_room(len(part))
            stream.write(part)
            stream.flush()

    try:
        async for piece in request.stream():
            held += piece
            most -= len(piece)
            if most < 0:
                raise HTTPException(413, "more bytes than were announced")
            if len(held) >= _PIECE:
                await to_thread.run_sync(write, bytes(held))
                held.clear()
    except ClientDisconnect:
        pass  # the received part is kept; nobody is there to answer
    if most >= 0:
        await to_thread.run_sync(write, bytes(held))


def read_metadata(header: str) -> dict[str, str]:
    """Return `Upload-Metadata`: keys with base64 values, separated by commas.

    Raises
    ------
    RequestError : wrong syntax, no file name, or an invalid hash.
    """
    metadata = {}
    for pair in header.split(","):
        key, _, value = pair.strip().partition(" ")
        try:
            metadata[key] = base64.b64decode(value, validate=True).decode()
        except (binascii.Error, UnicodeDecodeError) as error:
            raise RequestError("tus-base64", key=key[:40]) from error
    if not metadata.get("filename"):
        raise RequestError("tus-no-filename")
    digest = metadata.get("sha256")
    if digest is not None and (len(digest) != 64 or set(digest) - set("0123456789abcdef")):
        raise RequestError("tus-sha256")
    return metadata
