"""Answers that are documents: few are made at a time, and none is sent twice."""

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
_desks = threading.BoundedSemaphore(_AT_ONCE)


@contextmanager
def at_work_on_paper() -> Iterator[None]:
    """Make a document, when at most one other is being made in this process.

    Raises
    ------
    TooManyError : they take too long.
    """
    if not _desks.acquire(timeout=_PATIENCE_S):
        raise TooManyError("other documents are being made", 60)
    try:
        yield
    finally:
        _desks.release()


def document(
    request: Request, content: bytes, kind: str, name: str, *, shown: bool = False,
    missing: set[str] | None = None,
) -> Response:  # fmt: skip
    """A document as an answer; 304 where the asker has it already.

    Parameters
    ----------
    kind : its media type; name : of the file; shown : in the browser, rather than saved.
    missing : characters that its font lacks, told in `X-Not-Printed` (per cent, as in a URL).
    """
    tag = f'"{hashlib.sha256(content).hexdigest()[:32]}"'
    how = "inline" if shown else "attachment"
    headers = {"etag": tag, "content-disposition": f'{how}; filename="{name}"'}
    if missing:
        headers["x-not-printed"] = quote("".join(sorted(missing)[:40]))
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(content, headers=headers, media_type=kind)
