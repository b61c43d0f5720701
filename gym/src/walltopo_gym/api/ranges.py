"""Files of which a client may ask for a part, as players of video do (RFC 9110, section 14)."""

from __future__ import annotations

import re

from starlette.responses import StreamingResponse

from walltopo_gym.storage.files import FileStore

_ONE_RANGE = re.compile(r"bytes=(\d*)-(\d*)")


def ranged_file(
    store: FileStore, key: str, size: int, media_type: str, wanted: str | None
) -> StreamingResponse:
    """Return a private file, or the part that a `Range` header asks for.

    A header that does not name one range of bytes is ignored, as the standard allows.

    Parameters
    ----------
    size : of the file, bytes. wanted : the header's value.

    Raises
    ------
    NotFoundError : there is no such file.
    """
    headers = {"accept-ranges": "bytes", "cache-control": "private, no-cache"}
    part = None if wanted is None else _parse_byte_range(wanted, size)
    if part is None:
        headers["content-length"] = str(size)
        return StreamingResponse(store.chunks(key), media_type=media_type, headers=headers)
    begin, end = part
    if begin >= end:
        headers["content-range"] = f"bytes */{size}"
        return StreamingResponse(iter(()), 416, headers=headers)
    headers["content-range"] = f"bytes {begin}-{end - 1}/{size}"
    headers["content-length"] = str(end - begin)
    pieces = store.part(key, begin, end)
    return StreamingResponse(pieces, 206, media_type=media_type, headers=headers)


def _parse_byte_range(wanted: str, size: int) -> tuple[int, int] | None:
    """Return the first byte and the byte after the last one; an empty part lies outside the file.

    None: the header is to be ignored.
    """
    found = _ONE_RANGE.fullmatch(wanted.strip())
    if found is None or not any(found.groups()):
        return None
    first, last = found.groups()
    if not first:
        return max(size - int(last), 0), size
    if last and int(last) < int(first):
        return None
    return int(first), min(int(last) + 1, size) if last else size
