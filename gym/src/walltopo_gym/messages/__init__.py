"""Sentences by key: the server renders the English ones of `en.json` beside this file; the web app
takes the other languages from here.

A sentence that depends on a number has the plural forms of its language (`KEY_one`, `KEY_other`,
...), one of which `count` selects, as in i18next.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Final

import msgspec

_PLACE: Final = re.compile(r"\{(\w+)\}")


@cache
def sentences(language: str) -> dict[str, str]:
    """Return the sentences of a language by key."""
    content = files("walltopo_gym.messages").joinpath(f"{language}.json").read_bytes()
    return msgspec.json.decode(content, type=dict[str, str])


def english(key: str, values: Mapping[str, object]) -> str:
    """Return the English sentence of a key with its placeholders filled.

    Raises
    ------
    KeyError : there is no such key, or a value is missing.
    """
    known = sentences("en")
    if "count" in values and key not in known:
        key = f"{key}_one" if values["count"] == 1 else f"{key}_other"
    return _PLACE.sub(lambda place: str(values[place[1]]), known[key])
