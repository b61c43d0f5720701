"""The application: its endpoints, its guards, its document."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import FastAPI

from walltopo_gym.api import (
    about,
    boards,
    climbing,
    climbing_sessions,
    comments,
    competition_board,
    competition_entries,
    competition_order,
    competitions,
    editing,
    floor_plan,
    follows,
    grade_ranges,
    grades,
    gyms,
    hall_messages,
    hall_paper,
    hall_screen,
    handovers,
    health,
    insight_aims,
    insights,
    judging,
    logbook,
    me,
    members,
    metrics,
    oidc,
    own_data,
    pages,
    passkeys,
    passwords,
    past,
    pictures,
    plans,
    profiles,
    progress,
    publishing,
    routes,
    scans,
    second_factor,
    sessions,
    sign_up,
    tallies,
    tokens,
    uploads,
    walls,
    webhooks,
)
from walltopo_gym.api.bounds import LONGEST_BODY, Bounds
from walltopo_gym.api.cross_origin import CrossOriginGuard
from walltopo_gym.api.headers import SafeHeaders
from walltopo_gym.api.observed import Observed
from walltopo_gym.api.problems import PROBLEMS, handle_problems
from walltopo_gym.api.rules import declare_rules
from walltopo_gym.api.services import Services
from walltopo_gym.competitions.live import LiveBoards

PREFIX = "/api/v1"
# Requests are held against them in this order: where a whole hall asks comes first.
_ROOMS = (judging, climbing, competition_board, routes, tallies, walls, gyms, scans, sign_up,
          sessions, me, passwords, second_factor, tokens, members, grades, uploads, floor_plan,
          publishing, plans, editing, grade_ranges, pictures, comments, logbook, profiles,
          passkeys, handovers, own_data, past, webhooks, climbing_sessions, progress, boards,
          follows, insights, insight_aims, hall_screen, hall_paper, hall_messages, competitions,
          competition_entries, competition_order, about)  # fmt: skip


def build_app(services: Services) -> FastAPI:
    """The whole API over these services.

    Raises
    ------
    RuntimeError : an endpoint does not say who may use it.
    """
    app = FastAPI(
        title="walltopo gym",
        version=version("walltopo-gym"),
        openapi_url=f"{PREFIX}/openapi.json",
        # Both load scripts of other hosts.
        docs_url=None,
        redoc_url=None,
        responses=PROBLEMS,
        max_body_size=LONGEST_BODY,
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.services = services
    app.state.metrics = metrics.Metrics(services)
    app.state.boards = LiveBoards(services.database)
    for room in _ROOMS:
        declare_rules(room.router)
        # One by one: a router in a router is searched twice for each request.
        app.include_router(room.router, prefix=PREFIX)
    app.include_router(health.router)
    app.include_router(metrics.router)
    app.include_router(oidc.router)
    app.include_router(pages.router)  # the last: it answers for whatever is left
    handle_problems(app)
    app.add_middleware(CrossOriginGuard, origin=services.settings.link_base)
    app.add_middleware(Bounds, per_minute=services.settings.requests_per_minute)
    app.add_middleware(Observed, metrics=app.state.metrics)
    app.add_middleware(SafeHeaders)
    return app
