"""All output to the terminal.

Printed text contains file names, labels and messages from others. It is never interpreted as markup
unless the call has `markup=True`. No control character in it reaches the terminal, where it could
colour, overwrite or forge lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

# C0 and C1 controls (except line breaks and tabs), lone surrogates (from names that are not
# UTF-8), and the characters that change the direction of text.
_UNPRINTABLE = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]"
)


def escape_controls(text: str) -> str:
    """Return the text with terminal control characters escaped, such as `\\x1b`."""
    return _UNPRINTABLE.sub(lambda found: ascii(found[0])[1:-1], text)


class Terminal(Console):
    """A console that escapes control characters in text, but not rich's own."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
            else:
                yield Segment(escape_controls(segment.text), segment.style)


console = Terminal(highlight=False, markup=False, emoji=False)
error_console = Terminal(stderr=True, highlight=False, markup=False, emoji=False)
