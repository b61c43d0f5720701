"""What the server itself says on paper, in feeds, mails and messages, in four languages."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date
from functools import cache
from importlib.resources import files
from typing import Final

import msgspec

from walltopo_gym.languages import Language

__all__ = ["PAINT", "Words", "words_in"]

# Hold paint as the app shows it (gym/web/src/lib/colours.ts).
PAINT: Final = {
    "black": "#262628", "grey": "#7d7f82", "white": "#e8e8e2", "red": "#c32026",
    "orange": "#ee761e", "yellow": "#f5c819", "lime": "#96c832", "green": "#289141",
    "mint": "#3cbea5", "sky": "#64b4e1", "blue": "#1e55b9", "purple": "#6e37a0",
    "pink": "#e65091", "brown": "#6e482d", "wood": "#c8a070",
}  # fmt: skip


class Words(msgspec.Struct, frozen=True):
    """One language."""

    texts: Mapping[str, str]
    colours: Mapping[str, str]

    def say(self, key: str, **values: object) -> str:
        """A text with its places filled."""
        return self.texts[key].format(**values)

    def day(self, day: date) -> str:
        """A day as it is written in a line of text."""
        month = self.texts["months"].split()[day.month - 1]
        return self.say("date", day=day.day, month=month, year=day.year)

    def colour(self, name: str) -> str:
        """A colour of paint; a gym's own names stay as they are."""
        return self.colours.get(name, name)


@cache
def words_in(language: Language) -> Words:
    """The words of a language."""
    content = files("walltopo_gym.hall").joinpath("words.json").read_bytes()
    told = msgspec.json.decode(content)[language]
    colours = told.pop("colours")
    return Words(told, colours)
