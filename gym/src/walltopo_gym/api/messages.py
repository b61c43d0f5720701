"""What is said to people, by a stable code and its values, so that programs can say it otherwise.

`messages.json` has a code for each text that somebody with the app may meet. The rooms below
raise words and know no codes, nor does the product, whose errors are told here, too: so a code is
found by its text, as gettext does. The app has the same codes in other languages (`web/src/said`).
"""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files
from typing import Final

import msgspec

_PLACE: Final = re.compile(r"\{(\w+)\}")


class Message(msgspec.Struct, frozen=True):
    """A code, and what stands in the text's places."""

    code: str
    values: dict[str, str]


@cache
def templates() -> dict[str, str]:
    """The English text of each code."""
    content = files("walltopo_gym.api").joinpath("messages.json").read_bytes()
    return msgspec.json.decode(content, type=dict[str, str])


def message_of(text: str) -> Message | None:
    """The code of a text; None where it has none and is told in English."""
    code = _plain().get(text)
    if code is not None:
        return Message(code, {})
    for shape, found in _shapes():
        match = shape.fullmatch(text)
        if match is not None:
            return Message(found, match.groupdict())
    return None


def codes_of(title: str, hint: str) -> dict[str, object]:
    """`code`, `hint_code` and `values` of what is said and of what to do; those that there are."""
    found: dict[str, object] = {}
    values: dict[str, str] = {}
    for name, text in (("code", title), ("hint_code", hint)):
        message = message_of(text)
        if message is not None:
            found[name] = message.code
            values |= message.values
    return found | ({"values": values} if values else {})


@cache
def _plain() -> dict[str, str]:
    return {text: code for code, text in templates().items() if not _PLACE.search(text)}


@cache
def _shapes() -> list[tuple[re.Pattern[str], str]]:
    """Those with places, the most words first: what says more is no other's filling."""
    found = [(text, code) for code, text in templates().items() if _PLACE.search(text)]
    found.sort(key=lambda row: -len(_PLACE.sub("", row[0])))
    return [(re.compile(_pattern(text), re.DOTALL), code) for text, code in found]


def _pattern(text: str) -> str:
    parts = _PLACE.split(text)  # words and names of places in turn
    return "".join(
        f"(?P<{part}>.+?)" if number % 2 else re.escape(part) for number, part in enumerate(parts)
    )
