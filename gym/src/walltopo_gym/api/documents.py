"""Responses that are documents: few are made at a time, and unchanged ones are not sent again."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final
from urllib.parse import quote

from fastapi import Request, Response

from walltopo_gym.errors import TooManyError

_AT_ONCE: Final = 2
_PATIENCE_S: Final = 20
_slots = threading.BoundedSemaphore(_AT_ONCE)


@contextmanager
def at_work_on_paper() -> Iterator[None]:
    """Make a document while at most one other is being made in this process.

    Raises
    ------
    TooManyError : waiting took too long.
    """
    if not _slots.acquire(timeout=_PATIENCE_S):
        raise TooManyError("documents-busy", 60)
    try:
        yield
    finally:
        _slots.release()


def document(
    request: Request, content: bytes, kind: str, name: str, *, shown: bool = False,
    missing: set[str] | None = None,
) -> Response:  # fmt: skip
    """Return a document as a response; 304 if the client has it already.

    Parameters
    ----------
    kind : media type; name : file name; shown : whether the browser shows or saves it.
    missing : characters that its font lacks, for `X-Not-Printed` (percent-encoded).
    """
    tag = f'"{hashlib.sha256(content).hexdigest()[:32]}"'
    how = "inline" if shown else "attachment"
    headers = {"etag": tag, "content-disposition": f'{how}; filename="{name}"'}
    if missing:
        headers["x-not-printed"] = quote("".join(sorted(missing)[:40]))
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(content, headers=headers, media_type=kind)
