"""Log lines that no stranger's text can forge: one record is one line, and a traceback is indented.

Paths, file names, e-mail addresses and the texts of exceptions are other people's. A line break in
them would begin a line that looks like ours; an escape sequence would rewrite the terminal.
"""

from __future__ import annotations

import logging
import re
from traceback import TracebackException
from types import TracebackType
from typing import Final

_INDENT: Final = "    "
# A stack frame as `traceback` writes it, also within an exception group: it ends with source code.
_FRAME: Final = re.compile(r'[ |+-]*File "')

# `extra` of a record whose line breaks are ours, such as those of a mail: they are kept.
OWN_LINES: Final = {"has_own_lines": True}

_ExcInfo = tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None]


def escape_line(text: str) -> str:
    """Return a text on one line, with each character that is not printable as its escape.

    Line and paragraph separators, and characters that turn the direction of writing, count as not
    printable.
    """
    if text.isprintable():
        return text
    return "".join(
        one if one.isprintable() else one.encode("unicode_escape").decode() for one in text
    )


def traceback_of(error: BaseException) -> str:
    """Return an exception's traceback, whose lines are all indented.

    Frames keep their lines; the exceptions' own texts are on one line each.
    """
    lines: list[str] = []
    for piece in TracebackException.from_exception(error).format():
        parts = piece.splitlines() if _FRAME.match(piece) else [piece.strip("\n")]
        lines += [_INDENT + escape_line(part) for part in parts]
    return "\n".join(lines)


class PlainFormatter(logging.Formatter):
    """Formats a record as one line; lines of its traceback and `OWN_LINES` are indented."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 # logging's name
        """Return the record's line, and the further lines that are ours."""
        text = super().formatMessage(record)
        if not getattr(record, "has_own_lines", False):
            return escape_line(text)
        return f"\n{_INDENT}".join(escape_line(line) for line in text.split("\n"))

    def formatException(self, ei: _ExcInfo) -> str:  # noqa: N802 # logging's name
        """Return the traceback."""
        return "" if ei[1] is None else traceback_of(ei[1])

    def formatStack(self, stack_info: str) -> str:  # noqa: N802 # logging's name
        """Return the stack."""
        return "\n".join(_INDENT + escape_line(line) for line in stack_info.splitlines())
