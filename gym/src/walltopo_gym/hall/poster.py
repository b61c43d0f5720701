"""The poster of new routes: each wall with its picture and a code that leads to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from uuid import UUID

from walltopo_gym.gyms.models import Gym
from walltopo_gym.paper.sheet import Paper, Sheet
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.models import Wall
from walltopo_gym.words import PAINT, Words

_NO_PAINT = "#ffffff"


@dataclass(frozen=True)
class Poster:
    """The content of a poster.

    Parameters
    ----------
    walls : from left to right, with their new routes.
    picture : returns a version of a wall as a JPEG; None if it was never drawn.
    base : address of the server.
    """

    gym: Gym
    walls: Sequence[tuple[Wall, Sequence[Route]]]
    since: date
    until: date
    picture: Callable[[UUID], bytes | None]
    base: str

    def draw(self, words: Words, size: Paper) -> Sheet:
        """Return the pages.

        Raises
        ------
        RequestError : there are too many pages.
        """
        home = f"{self.base}/g/{self.gym.slug}"
        period = words.say("since", **{"from": words.day(self.since), "to": words.day(self.until)})
        sheet = Sheet(
            f"{self.gym.name}: {words.say('new')}",
            period,
            foot=f"{self.gym.name} · {home}",
            page=words.say("page", page="{page}", pages="{pages}"),
            code=home,
            code_note=words.say("scan"),
            size=size,
            lacks=words.say("lacks", scripts="{scripts}"),
        )
        if not self.walls:
            sheet.text(words.say("nothing"))
        for wall, routes in self.walls:
            shown = wall.published_scan_id and self.picture(wall.published_scan_id)
            sheet.heading(wall.name, below=95 if shown else 30)
            if shown:
                sheet.picture(shown, f"{home}/w/{wall.id}", words.say("see"))
            sheet.table(
                [],
                [
                    [route.name or words.colour(route.colour), route.grade, route.setter]
                    for route in routes
                ],
                widths=[6, 2, 3],
                bold={1},
                dots=[PAINT.get(route.colour, _NO_PAINT) for route in routes],
            )
        return sheet
