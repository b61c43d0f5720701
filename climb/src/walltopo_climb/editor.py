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
from walltopo_climb.problems.adjust_grade import Direction
from walltopo_climb.problems.rows import Proposals, Tweaks
from walltopo_climb.problems.spec import ProblemSpec
from walltopo_climb.problems.wall import SetWall

_SEARCHING = threading.Lock()  # a search uses a CPU core for seconds


class ProposeIn(PreviewIn, frozen=True, forbid_unknown_fields=True):
    """A request for new problems on the wall after a log."""

    spec: ProblemSpec


class EaseIn(PreviewIn, frozen=True, forbid_unknown_fields=True):
    """A request to make a route of the wall one grade easier or harder."""

    route: Label
    way: Direction


def propose_on(session: EditSession, log: EditLog, spec: ProblemSpec) -> Proposals:
    """Return problems on the wall after a log; this takes seconds and writes nothing."""
    wall = _build_wall(session, log)
    with _SEARCHING:
        return wall.propose(spec)


def adjust_grade_on(session: EditSession, log: EditLog, route: int, direction: Direction) -> Tweaks:
    """Return the holds that make a route one grade easier or harder; this writes nothing."""
    wall = _build_wall(session, log)
    with _SEARCHING:
        return wall.adjust_grade(route, direction)


def editor_routes(session: EditSession) -> Sequence[BaseRoute]:
    """Return the routes of this plug-in."""

    async def propose(request: Request) -> Response:
        body = await read_body(request, ProposeIn)
        return json_response(await run_in_threadpool(propose_on, session, body.edits, body.spec))

    async def ease(request: Request) -> Response:
        body = await read_body(request, EaseIn)
        return json_response(
            await run_in_threadpool(adjust_grade_on, session, body.edits, body.route, body.way)
        )

    return (
        Route(f"{EDITS}/problems", propose, methods=["POST"]),
        Route(f"{EDITS}/ease", ease, methods=["POST"]),
    )


def _build_wall(session: EditSession, log: EditLog) -> SetWall:
    outcome, snapshot = session.outcome(log)
    floor_known = Scale.load(session.folder.scale).floor_known
    return SetWall.build(outcome.holds.holds, outcome.routes.routes, snapshot.unit, floor_known)
