"""Read text of other programs: UTF-8 and UTF-16, with or without a byte-order mark.

Editors on Windows begin a UTF-8 file with a mark, and their "Unicode" is UTF-16. All readers of
text take their bytes from here.
"""

from __future__ import annotations

import codecs
from pathlib import Path

from walltopo.core.errors import InputError, prefix_errors

# The longer marks come first: that of UTF-32 begins with that of UTF-16.
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def as_utf8(content: bytes) -> bytes:
    """Return text as UTF-8 without a byte-order mark; bytes without sign of UTF-16 are unchanged.

    A file whose first two bytes are a NUL and another byte is UTF-16 without a mark, since these
    formats begin with a character of ASCII.

    Raises
    ------
    InputError : the bytes are not valid in the encoding of their mark.
    """
    encoding, mark = _encoding_of(content)
    if encoding in ("", "utf-8"):
        return content[len(mark) :]
    try:
        return content[len(mark) :].decode(encoding).encode()
    except UnicodeError as error:
        raise InputError(
            f"not valid {encoding.upper()} ({error})", "Save the file as UTF-8."
        ) from error


def _encoding_of(content: bytes) -> tuple[str, bytes]:
    """Return the encoding that the first bytes tell, "" without any, and the mark."""
    for mark, encoding in _MARKS:
        if content.startswith(mark):
            return encoding, mark
    if content[1:2] == b"\0" != content[:1]:
        return "utf-16-le", b""
    if content[:1] == b"\0" != content[1:2] and len(content) > 1:
        return "utf-16-be", b""
    return "", b""


def read_utf8(path: Path) -> bytes:
    """Return the text of a file as UTF-8 without a byte-order mark.

    Raises
    ------
    InputError : the file is missing, unreadable or damaged UTF-16; the message names the file.
    """
    try:
        content = Path(path).read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    with prefix_errors(path):
        return as_utf8(content)


def read_text(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    InputError : see `read_utf8`; or the file is neither UTF-8 nor UTF-16.
    """
    try:
        return read_utf8(path).decode()
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: not text in UTF-8 ({error})", "Save the file as UTF-8."
        ) from error


def first_text(path: Path, size: int) -> str:
    """Return about the first `size` bytes of a file as text; "" for an unreadable file."""
    try:
        with path.open("rb") as stream:
            head = stream.read(size)
    except OSError:
        return ""
    encoding, mark = _encoding_of(head)
    return head[len(mark) :].decode(encoding or "utf-8", "replace")
