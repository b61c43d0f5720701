"""The application: endpoints, middleware, OpenAPI document."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version
from typing import Final
from uuid import UUID

from anyio import CapacityLimiter
from anyio.to_thread import current_default_thread_limiter
from fastapi import APIRouter, FastAPI, Request
from sqlalchemy.orm import Session

import walltopo_gym.accounts.http as accounts
import walltopo_gym.climbing.http as climbing
import walltopo_gym.competitions.http as competitions
import walltopo_gym.editing.http as editing
import walltopo_gym.grading.http as grading
import walltopo_gym.gyms.http as gyms
import walltopo_gym.hall.http as hall
import walltopo_gym.hold_reports.http as hold_reports
import walltopo_gym.insights.http as insights
import walltopo_gym.operating.http as operating
import walltopo_gym.problems.http as problems
import walltopo_gym.publishing.http as publishing
import walltopo_gym.reset_plans.http as reset_plans
import walltopo_gym.scans.http as scans
import walltopo_gym.walls.http as walls
import walltopo_gym.webhooks.http as webhooks
from walltopo_gym.accounts.access import declare_rules
from walltopo_gym.accounts.http import oidc
from walltopo_gym.accounts.passwords import Passwords
from walltopo_gym.api.middleware import BodyLimit, Bounds, CrossOriginGuard, SafeHeaders
from walltopo_gym.api.problems import PROBLEMS, handle_problems
from walltopo_gym.api.services import Hooks, Services
from walltopo_gym.climbing.counting import queue_recount
from walltopo_gym.climbing.people import took_part
from walltopo_gym.competitions.live import LiveBoards
from walltopo_gym.database.engine import CONNECTIONS, Database
from walltopo_gym.editing.service import EditSessions
from walltopo_gym.gyms.access import feature_rule
from walltopo_gym.hall.http.screen import admits
from walltopo_gym.mail import make_mailer
from walltopo_gym.operating.http import Metrics, health_router, metrics_router
from walltopo_gym.problems.estimate import Estimator
from walltopo_gym.scans.http.uploads import LONGEST_PHOTO
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.server import pages
from walltopo_gym.server.observed import Observed
from walltopo_gym.settings import Feature, GymSettings
from walltopo_gym.storage.files import open_store, private_folder

PREFIX = "/api/v1"
_THREADS: Final = 200  # an idle one costs next to nothing
_LONGER_BODIES: Final = ((re.compile(rf"PATCH {PREFIX}/gyms/[^/]+/photos/[^/]+"), LONGEST_PHOTO),)
# Each slice's endpoints, and the optional feature that they are. Routes are matched in this order:
# the slices that a whole hall uses at once come first.
_SLICES: Final[tuple[tuple[Feature | None, tuple[APIRouter, ...]], ...]] = (
    ("competitions", competitions.ROUTERS),
    (None, climbing.ROUTERS),
    (None, publishing.ROUTERS),
    (None, walls.ROUTERS),
    (None, gyms.ROUTERS),
    (None, scans.ROUTERS),
    (None, accounts.ROUTERS),
    (None, editing.ROUTERS),
    (None, grading.ROUTERS),
    (None, hold_reports.ROUTERS),
    (None, problems.ROUTERS),
    (None, reset_plans.ROUTERS),
    ("insights", insights.ROUTERS),
    ("hall", hall.ROUTERS),
    (None, webhooks.ROUTERS),
    (None, operating.ROUTERS),
)


def open_services(settings: GymSettings) -> Services:
    """Return the services of the settings."""
    private_folder(settings.data)
    database, store = Database(settings.database_url), open_store(settings)
    incoming = Incoming(
        settings.data / "incoming", settings.keep_free_mb, copied=not settings.objects
    )
    edit_sessions = EditSessions(settings.data / "editing", settings.max_edited, database, store)
    parts = (Passwords(), incoming, edit_sessions, LiveBoards(database), Estimator())
    return Services(
        settings, database, make_mailer(settings), store, {type(part): part for part in parts}
    )


@asynccontextmanager
async def _many_threads(app: FastAPI) -> AsyncIterator[None]:
    """Let more threads wait for the one writer of SQLite, so that it always finds one itself."""
    current_default_thread_limiter().total_tokens = _THREADS
    yield


def build_app(services: Services) -> FastAPI:
    """Return the whole API over these services.

    Raises
    ------
    RuntimeError : an endpoint does not declare an access rule.
    """
    app = FastAPI(
        lifespan=_many_threads,
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
    app.state.places = CapacityLimiter(CONNECTIONS)
    app.state.turns = {}
    app.state.metrics = Metrics(services)
    features = services.settings.features
    app.state.hooks = Hooks(
        admits=admits if "hall" in features else _admits_nobody,
        took_part=took_part,
        days_changed=queue_recount,
    )
    for feature, routers in _SLICES:
        if feature is not None and feature not in features:
            continue
        optional = [] if feature is None else [feature_rule(feature)]
        for router in routers:
            declare_rules(router)
            # One by one: a router in a router is searched twice for each request.
            app.include_router(router, prefix=PREFIX, dependencies=optional)
    app.include_router(health_router)
    app.include_router(metrics_router)
    app.include_router(oidc.router)
    app.include_router(pages.router)  # the last: it answers every path that is left
    handle_problems(app)
    app.add_middleware(BodyLimit, longer=_LONGER_BODIES)
    app.add_middleware(CrossOriginGuard, origin=services.settings.link_base)
    app.add_middleware(Bounds, per_minute=services.settings.requests_per_minute)
    app.add_middleware(Observed, metrics=app.state.metrics)
    app.add_middleware(SafeHeaders)
    return app


def _admits_nobody(session: Session, gym: UUID, request: Request) -> bool:
    return False
