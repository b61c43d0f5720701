"""Endpoints of health, metrics, server facts, and a person's own data."""

from __future__ import annotations

import hmac
from typing import Any

from fastapi import APIRouter, Request, Response
from obstore.exceptions import BaseError
from prometheus_client import generate_latest
from pydantic import BaseModel
from sqlalchemy import text
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import JSONResponse

from walltopo_gym.accounts.access import AnyoneMay, SignedInMay
from walltopo_gym.accounts.cookies import sign_out_here
from walltopo_gym.accounts.notices import NotifyOwner
from walltopo_gym.accounts.passwords import Password, check_own_password
from walltopo_gym.api.error_responses import error_response
from walltopo_gym.api.fields import Body
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.tables import CsvDialectOf, CsvFile
from walltopo_gym.errors import NotFoundError, RequestError
from walltopo_gym.operating.metrics import Metrics
from walltopo_gym.operating.own_data import all_of, ascents_csv, delete_account
from walltopo_gym.scans.incoming import Incoming

router = APIRouter(tags=["accounts"])


class DeleteAccount(Body):
    """The password, so that an unattended browser cannot delete the account."""

    password: Password


@router.get("/me/data")
def read_data(response: Response, session: Db, actor: SignedInMay) -> dict[str, Any]:
    """Return all data of one's account."""
    response.headers["content-disposition"] = 'attachment; filename="walltopo.json"'
    return all_of(session, actor.known)


@router.get("/me/ascents.csv", response_class=CsvFile)
def read_ascents_table(session: Db, actor: SignedInMay, dialect: CsvDialectOf) -> CsvFile:
    """Return one's ascents as CSV."""
    return CsvFile.of("ascents", ascents_csv(session, actor.known, dialect))


@router.post("/me/delete", status_code=204)
def delete_me(
    body: DeleteAccount,
    response: Response,
    services: ServicesOf,
    notify: NotifyOwner,
    actor: SignedInMay,
) -> None:
    """Delete one's account with all of its data. The owner gets a mail."""
    check_own_password(services, actor.known, body.password)
    with services.database.writing() as session:
        notify(session, actor.known, "account-deleted")
        delete_account(session, actor.known, by=actor.known)
    sign_out_here(response)


about_router = APIRouter(tags=["server"])


class ServerOut(BaseModel):
    """The ways to sign in; `oidc`: name of the other server behind `/oidc/sign-in`."""

    sign_up: str
    new_gyms: str
    oidc: str | None


@about_router.get("/server")
def read_server(services: ServicesOf, actor: AnyoneMay) -> ServerOut:
    """Return facts of this server."""
    settings = services.settings
    return ServerOut(
        sign_up=settings.sign_up,
        new_gyms=settings.new_gyms,
        oidc=settings.oidc_name if settings.oidc_issuer else None,
    )


health_router = APIRouter(tags=["health"], include_in_schema=False)


class Health(BaseModel):
    status: str


@health_router.get("/health")
def read_health() -> Health:
    """Return 200 while the process responds."""
    return Health(status="ok")


@health_router.get("/ready", response_model=Health)
def read_readiness(services: ServicesOf) -> Health | JSONResponse:
    """Return whether database and file store respond, and how full the disk is."""
    try:
        with services.database.reading() as session:
            session.execute(text("SELECT 1"))
    except SQLAlchemyError:
        return error_response(RequestError("database-away"), 503)
    try:
        services.store.has("nothing")
    except (BaseError, OSError):
        return error_response(RequestError("store-away"), 503)
    fullness = services.get(Incoming).fullness()
    if fullness == "full":
        return error_response(RequestError("disk-is-full", "disk-make-room"), 503)
    return Health(status="ok" if fullness == "ok" else f"the disk is {fullness}")


metrics_router = APIRouter(include_in_schema=False)


@metrics_router.get("/metrics")
def read_metrics(request: Request, services: ServicesOf) -> Response:
    """Return the metrics; 404 without a token in the settings."""
    token = services.settings.metrics_token
    given = request.headers.get("authorization", "").encode()
    if not token or not hmac.compare_digest(given, f"Bearer {token}".encode()):
        raise NotFoundError("not-found")
    metrics: Metrics = request.app.state.metrics
    return Response(generate_latest(metrics.registry), media_type="text/plain; version=0.0.4")
