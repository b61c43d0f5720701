"""The server's own texts on paper, in feeds, mails and messages, in four languages."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date
from functools import cache
from importlib.resources import files
from typing import Final

import msgspec

from walltopo_gym.languages import Language

_HERE: Final = files("walltopo_gym")
# Hold paint; the app shows it from the same file (gym/web/src/lib/colours.ts).
PAINT: Final = msgspec.json.decode(_HERE.joinpath("paint.json").read_bytes(), type=dict[str, str])


class Words(msgspec.Struct, frozen=True):
    """The texts of one language."""

    texts: Mapping[str, str]
    colours: Mapping[str, str]

    def say(self, key: str, **values: object) -> str:
        """Return a text with its placeholders filled."""
        return self.texts[key].format(**values)

    def day(self, day: date) -> str:
        """Return a day as text."""
        month = self.texts["months"].split()[day.month - 1]
        return self.say("date", day=day.day, month=month, year=day.year)

    def colour(self, name: str) -> str:
        """Return the name of a paint colour; a gym's own names stay as they are."""
        return self.colours.get(name, name)


@cache
def words_in(language: Language) -> Words:
    """Return the texts of a language."""
    by_key = msgspec.json.decode(_HERE.joinpath("words.json").read_bytes())[language]
    colours = by_key.pop("colours")
    return Words(by_key, colours)
