"""What is new, on a poster: wall by wall with its picture, each with a code that leads to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from uuid import UUID

from walltopo_gym.gyms.models import Gym, Wall
from walltopo_gym.hall.words import PAINT, Words
from walltopo_gym.paper.sheet import Paper, Sheet
from walltopo_gym.publishing.models import Route

_NO_PAINT = "#ffffff"


@dataclass(frozen=True)
class Poster:
    """What stands on it.

    Parameters
    ----------
    walls : from left to right, with what is new there.
    picture : of a version of a wall as a JPEG; None where it was never drawn.
    base : address of the server.
    """

    gym: Gym
    walls: Sequence[tuple[Wall, Sequence[Route]]]
    since: date
    until: date
    picture: Callable[[UUID], bytes | None]
    base: str

    def drawn(self, words: Words, size: Paper) -> Sheet:
        """The pages.

        Raises
        ------
        InputError : too many of them, when the document is made.
        """
        home = f"{self.base}/g/{self.gym.slug}"
        period = words.say("since", **{"from": words.day(self.since), "to": words.day(self.until)})
        sheet = Sheet(
            f"{self.gym.name}: {words.say('new')}", period, foot=f"{self.gym.name} · {home}",
            page=words.say("page", page="{page}", pages="{pages}"), code=home,
            code_note=words.say("scan"), size=size,
        )  # fmt: skip
        if not self.walls:
            sheet.text(words.say("nothing"))
        for wall, routes in self.walls:
            shown = wall.published_scan_id and self.picture(wall.published_scan_id)
            sheet.heading(wall.name, below=95 if shown else 30)
            if shown:
                sheet.picture(shown, f"{home}/w/{wall.id}", words.say("see"))
            sheet.table(
                [],
                [[route.name or words.colour(route.colour), route.grade, route.setter]
                 for route in routes],
                widths=[6, 2, 3], bold={1},
                dots=[PAINT.get(route.colour, _NO_PAINT) for route in routes],
            )  # fmt: skip
        return sheet
