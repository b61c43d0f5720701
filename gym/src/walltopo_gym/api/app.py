"""The application: its endpoints, its guards, its document."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import APIRouter, FastAPI

from walltopo_gym.api import (
    climbing,
    editing,
    grades,
    gyms,
    health,
    me,
    members,
    passwords,
    publishing,
    routes,
    scans,
    sessions,
    sign_up,
    tokens,
    uploads,
    walls,
)
from walltopo_gym.api.cross_origin import CrossOriginGuard
from walltopo_gym.api.headers import SafeHeaders
from walltopo_gym.api.problems import PROBLEMS, handle_problems
from walltopo_gym.api.rules import declare_rules
from walltopo_gym.api.services import Services

__all__ = ["PREFIX", "build_app"]

PREFIX = "/api/v1"
_ROOMS = (sign_up, sessions, me, passwords, tokens, gyms, members, grades, walls, scans, uploads,
          publishing, editing, routes, climbing)  # fmt: skip


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
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.services = services
    api = APIRouter(prefix=PREFIX)
    for room in _ROOMS:
        declare_rules(room.router)
        api.include_router(room.router)
    app.include_router(api)
    app.include_router(health.router)
    handle_problems(app)
    app.add_middleware(CrossOriginGuard, origin=services.settings.link_base)
    app.add_middleware(SafeHeaders)
    return app
