"""Problems and grade adjustments in the editor: routes that `walltopo.editing.http` adds."""

from __future__ import annotations

import threading
from collections.abc import Sequence

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from walltopo.editing.http import EDITS, PreviewIn, json_response, read_body
from walltopo.editing.session import EditSession
from walltopo.scans.document import Label
from walltopo.scans.edits import EditLog
from walltopo.scans.scale import Scale
from walltopo_climb.problems.ease import Way
from walltopo_climb.problems.rows import Proposals, Tweaks
from walltopo_climb.problems.wall import SetWall
from walltopo_climb.problems.wish import Wish

_SEARCHING = threading.Lock()  # a search takes a processor for seconds


class ProposeIn(PreviewIn, frozen=True, forbid_unknown_fields=True):
    """A request for new problems on the wall that a log makes."""

    wish: Wish


class EaseIn(PreviewIn, frozen=True, forbid_unknown_fields=True):
    """A request to make a route of the wall one grade easier or harder."""

    route: Label
    way: Way


def propose_on(session: EditSession, log: EditLog, wish: Wish) -> Proposals:
    """Return problems on the wall that a log makes; takes seconds, writes nothing."""
    wall = _wall(session, log)
    with _SEARCHING:
        return wall.propose(wish)


def ease_on(session: EditSession, log: EditLog, route: int, way: Way) -> Tweaks:
    """Return the holds that make a route one grade easier or harder; writes nothing."""
    wall = _wall(session, log)
    with _SEARCHING:
        return wall.ease(route, way)


def editor_routes(session: EditSession) -> Sequence[BaseRoute]:
    """Return the routes of this plug-in."""

    async def propose(request: Request) -> Response:
        body = await read_body(request, ProposeIn)
        return json_response(await run_in_threadpool(propose_on, session, body.edits, body.wish))

    async def ease(request: Request) -> Response:
        body = await read_body(request, EaseIn)
        return json_response(
            await run_in_threadpool(ease_on, session, body.edits, body.route, body.way)
        )

    return (
        Route(f"{EDITS}/problems", propose, methods=["POST"]),
        Route(f"{EDITS}/ease", ease, methods=["POST"]),
    )


def _wall(session: EditSession, log: EditLog) -> SetWall:
    outcome, snapshot = session.outcome(log)
    floor_known = Scale.load(session.folder.scale).floor_known
    return SetWall.of(outcome.holds.holds, outcome.routes.routes, snapshot.unit, floor_known)
