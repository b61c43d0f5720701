"""The application: endpoints, middleware, OpenAPI document."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from importlib.metadata import version
from typing import Any, Final

from anyio import CapacityLimiter
from anyio.to_thread import current_default_thread_limiter
from fastapi import APIRouter, FastAPI

import walltopo_gym.accounts.http as accounts
import walltopo_gym.climbing.http as climbing
import walltopo_gym.editing.http as editing
import walltopo_gym.gyms.http as gyms
import walltopo_gym.operating.http as operating
import walltopo_gym.publishing.http as publishing
import walltopo_gym.scans.http as scans
import walltopo_gym.walls.http as walls
from walltopo_gym.accounts.access import declare_rules
from walltopo_gym.accounts.http import oidc
from walltopo_gym.accounts.passwords import Passwords
from walltopo_gym.api.error_responses import ERROR_RESPONSES, handle_errors
from walltopo_gym.api.middleware import (
    BodyLimit,
    Bounds,
    CrossOriginGuard,
    CrossOriginSharing,
    SafeHeaders,
)
from walltopo_gym.api.request_counts import SharedCounts
from walltopo_gym.api.services import Services
from walltopo_gym.database.engine import CONNECTIONS
from walltopo_gym.editing.service import EditSessions
from walltopo_gym.features import features_on, open_database
from walltopo_gym.gyms.access import feature_rule
from walltopo_gym.mail import make_mailer
from walltopo_gym.operating.http.server import health_router, metrics_router
from walltopo_gym.operating.http.setup import MAX_UPLOAD
from walltopo_gym.operating.metrics import Metrics
from walltopo_gym.operating.restoration import Restoration
from walltopo_gym.operating.setup import Setup
from walltopo_gym.scans.incoming import LONGEST_PHOTO, Incoming
from walltopo_gym.server import oembed, pages
from walltopo_gym.server.request_log import RequestLogMiddleware
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import open_store, private_folder

PREFIX = "/api/v1"
_THREADS: Final = 200  # an idle one costs next to nothing
_LONGER_BODIES: Final = (
    (re.compile(rf"PUT {PREFIX}/setup/backup"), MAX_UPLOAD),
    (re.compile(rf"PATCH {PREFIX}/gyms/[^/]+/(photos|clips)/[^/]+"), LONGEST_PHOTO),
)
# Routes are matched in this order: what a whole hall uses at once comes first.
_CORE: Final = (
    climbing.ROUTERS,
    publishing.ROUTERS,
    walls.ROUTERS,
    gyms.ROUTERS,
    scans.ROUTERS,
    accounts.ROUTERS,
    editing.ROUTERS,
    operating.ROUTERS,
)


def open_services(settings: GymSettings) -> Services:
    """Return the services of the settings."""
    private_folder(settings.data)
    database, store = open_database(settings), open_store(settings)
    incoming = Incoming(
        settings.data / "incoming", settings.keep_free_mb, copied=not settings.objects
    )
    edit_sessions = EditSessions(settings.data / "editing", settings.max_edited, database, store)
    own = [part for feature in features_on(settings) for part in feature.parts(database)]
    parts = (Passwords(), incoming, edit_sessions, Restoration(), Setup(), *own)
    return Services(
        settings, database, make_mailer(settings), store, {type(part): part for part in parts}
    )


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Let more threads wait for the one writer of SQLite, so that it always finds one itself; share
    the counts of requests with other servers."""
    current_default_thread_limiter().total_tokens = _THREADS
    counts: SharedCounts = app.state.counts
    async with counts.exchanging():
        yield


def build_app(services: Services) -> FastAPI:
    """Return the whole API over these services.

    Raises
    ------
    RuntimeError : an endpoint does not declare an access rule.
    """
    app = FastAPI(
        lifespan=_lifespan,
        title="walltopo gym",
        version=version("walltopo-gym"),
        openapi_url=f"{PREFIX}/openapi.json",
        # Both load scripts of other hosts.
        docs_url=None,
        redoc_url=None,
        responses=ERROR_RESPONSES,
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.services = services
    app.state.transaction_slots = CapacityLimiter(CONNECTIONS)
    app.state.turns = {}
    app.state.metrics = Metrics(services)
    per_minute = services.settings.requests_per_minute
    app.state.counts = SharedCounts(services.database, per_minute)
    for routers in _CORE:
        _include_routers(app, routers, [])
    for feature in features_on(services.settings):
        switched = [] if feature.switch is None else [feature_rule(feature.switch)]
        _include_routers(app, feature.routers(), switched)
        for router in feature.root_routers():
            app.include_router(router)
    app.include_router(health_router)
    app.include_router(metrics_router)
    app.include_router(oidc.router)
    app.include_router(oembed.router)
    app.include_router(pages.router)  # the last: it answers every path that is left
    handle_errors(app)
    app.add_middleware(BodyLimit, longer=_LONGER_BODIES)
    app.add_middleware(CrossOriginGuard, origin=services.settings.link_base)
    app.add_middleware(Bounds, per_minute=per_minute, counts=app.state.counts)
    app.add_middleware(RequestLogMiddleware, metrics=app.state.metrics)
    app.add_middleware(CrossOriginSharing)
    app.add_middleware(SafeHeaders)
    return app


def _include_routers(app: FastAPI, routers: Sequence[APIRouter], rules: Sequence[Any]) -> None:
    """Add endpoints, one by one: a router in a router is searched twice for each request."""
    for router in routers:
        declare_rules(router)
        app.include_router(router, prefix=PREFIX, dependencies=rules)
