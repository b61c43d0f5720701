"""Responses that are documents: few are made at a time, and unchanged ones are not sent again."""

from __future__ import annotations

import hashlib
from typing import Annotated
from urllib.parse import quote

from fastapi import Request, Response

from walltopo_gym.api.turns import turn_for

DocumentTurn = Annotated[None, turn_for("documents", 2)]


def document_response(
    request: Request,
    content: bytes,
    kind: str,
    name: str,
    *,
    shown: bool = False,
    missing: set[str] | None = None,
) -> Response:
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
