"""Conversion of our docstrings for the API reference: a griffe extension, named in `zensical.toml`.

Signatures contain the types, so a docstring describes a parameter on the same line:

    faces : (F, 3) int32, corners of the triangles.

NumPy's own style has the type there and the description below it.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

_SECTION = re.compile(r"^(Parameters|Raises|Returns|Attributes)\n-+\n", re.MULTILINE)
# Our one-line form, unlike numpydoc's `name : type` with an indented description below.
_ENTRY = re.compile(r"^([A-Za-z_*][\w*.]*(?:, [\w*.]+)*) : (.+)$")


def as_numpy(text: str) -> str:
    """Return the docstring with every description on an indented line of its own.

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
    """Griffe extension that converts the docstring of every object before it is parsed."""

    def on_object(self, *, obj: Object, **kwargs: Any) -> None:
        if obj.docstring is not None:
            obj.docstring.value = as_numpy(obj.docstring.value)
