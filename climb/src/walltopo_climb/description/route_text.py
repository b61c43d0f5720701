"""`walltopo describe`: the file of a description, and its text."""

from __future__ import annotations

from pathlib import Path

import msgspec

from walltopo.core import InputError
from walltopo.scans.document import Coordinate, Document, Label
from walltopo.scans.folder import ScanFolder
from walltopo.scans.routes import route_name
from walltopo_climb.description.sentences import (
    USUAL,
    Language,
    Sentence,
    Wording,
    sentences_of,
)
from walltopo_climb.description.steps import route_steps
from walltopo_climb.movement.body import Body
from walltopo_climb.movement.rows import climber_rows


class Description(Document, frozen=True, kw_only=True):
    """A described route, as `walltopo describe --format json` writes it.

    Parameters
    ----------
    route : its id. language : of the sentences.
    height, span : of the body, m; `height_m` and `span_m` in the file.
    metric : whether distances were measured, and not estimated by the size of holds.
    sentences : in their order.
    """

    route: Label
    language: Language
    height: Coordinate = msgspec.field(name="height_m")
    span: Coordinate = msgspec.field(name="span_m")
    metric: bool
    sentences: tuple[Sentence, ...]

    @property
    def text(self) -> str:
        """Return the sentences, one a line."""
        return "\n".join(sentence.text for sentence in self.sentences)


def describe_route(scan: Path, route: int, body: Body, words: Wording = USUAL) -> Description:
    """Return the description of a route of a scan.

    Parameters
    ----------
    scan : the scan folder. route : id of the route. body : the climber.

    Raises
    ------
    InputError : the scan has no holds or routes; no route has this id; the route has no start or
        no top; or the body cannot reach the start.
    """
    folder = ScanFolder(scan)
    found, routes = ScanFolder.holds.load(folder), ScanFolder.routes.load(folder).routes
    chosen = next((one for one in routes if one.id == route), None)
    if chosen is None:
        ids = ", ".join(str(one.id) for one in routes) or "none"
        raise InputError(f"{scan}: no route has the number {route}", f"Its routes: {ids}.")
    rows = climber_rows(chosen, found.holds, found.unit, {"you": body})
    if not rows:
        raise InputError(
            f"{route_name(chosen)} has no start, no top, or no hold between",
            "Mark start and top in the editor (`walltopo view --edit`).",
        )
    steps = route_steps(chosen, rows[0], found.holds, found.unit)
    return Description(
        route=route,
        language=words.language,
        height=body.height,
        span=body.span,
        metric=found.metric,
        sentences=sentences_of(steps, words),
    )
