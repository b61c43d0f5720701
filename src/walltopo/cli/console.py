"""The one place that writes to the terminal.

What is printed comes from file names, labels and messages that others wrote: nothing in it is
taken for markup unless the call says `markup=True`, and no control character in it reaches the
terminal, where it could colour, overwrite or forge lines.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

# C0 and C1 controls (line breaks and tabs apart), half surrogates (from names that are not
# UTF-8), and the signs that turn the direction of text.
_UNPRINTABLE = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]"
)


def visible(text: str) -> str:
    """The text with every character that a terminal would obey written out, such as `\\x1b`."""
    return _UNPRINTABLE.sub(lambda found: ascii(found[0])[1:-1], text)


class Terminal(Console):
    """A console whose text is only text; its own colours and cursor movements are rich's."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
            else:
                yield Segment(visible(segment.text), segment.style)


# A terminal that cannot show a character shows its code; it does not end the command.
for _stream in (sys.stdout, sys.stderr):
    if isinstance(_stream, io.TextIOWrapper):
        _stream.reconfigure(errors="backslashreplace")

console = Terminal(highlight=False, markup=False, emoji=False)
error_console = Terminal(stderr=True, highlight=False, markup=False, emoji=False)
