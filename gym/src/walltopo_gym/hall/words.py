"""What the server itself says on paper, in feeds, mails and messages, in four languages."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date
from functools import cache
from importlib.resources import files
from typing import Final

import msgspec

from walltopo_gym.languages import Language

_HERE: Final = files("walltopo_gym.hall")
# Hold paint; the app shows it from the same file (gym/web/src/lib/colours.ts).
PAINT: Final = msgspec.json.decode(_HERE.joinpath("paint.json").read_bytes(), type=dict[str, str])


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
    told = msgspec.json.decode(_HERE.joinpath("words.json").read_bytes())[language]
    colours = told.pop("colours")
    return Words(told, colours)
