"""Our docstrings as the API reference wants them: a griffe extension, named in `zensical.toml`.

Types stand in the signatures, so a docstring says what a parameter means on the same line:

    faces : (F, 3) int32, corners of the triangles.

NumPy's own style has the type there and the meaning below it.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

_SECTION = re.compile(r"^(Parameters|Raises|Returns|Attributes)\n-+\n", re.MULTILINE)
# Not numpydoc's `name : type` with an indented text below.
_ENTRY = re.compile(r"^([A-Za-z_*][\w*.]*(?:, [\w*.]+)*) : (.+)$")


def as_numpy(text: str) -> str:
    """The docstring with every meaning on a line of its own, indented.

    >>> print(as_numpy("Parameters\\n----------\\na : first.\\nb, c : the others; d : more."))
    Parameters
    ----------
    a
        first.
    b, c
        the others; d : more.
    """
    found = _SECTION.search(text)
    if found is None:
        return text
    lines: list[str] = []
    for line in text[found.end() :].split("\n"):
        entry = _ENTRY.match(line)
        lines += [entry[1], f"    {entry[2]}"] if entry else [line]
    return text[: found.end()] + "\n".join(lines)


class OneLine(Extension):
    """Turns the docstring of every object before it is parsed."""

    def on_object(self, *, obj: Object, **kwargs: Any) -> None:
        if obj.docstring is not None:
            obj.docstring.value = as_numpy(obj.docstring.value)
