"""For whoever watches the server: is it alive, can it work. Tells no more than that."""

from __future__ import annotations

from fastapi import APIRouter
from obstore.exceptions import BaseError
from pydantic import BaseModel
from sqlalchemy import text
from sqlalchemy.exc import SQLAlchemyError
from starlette.responses import JSONResponse

from walltopo_gym.api.problems import problem
from walltopo_gym.api.services import ServicesOf

router = APIRouter(tags=["health"], include_in_schema=False)


class Health(BaseModel):
    status: str


@router.get("/health")
def read_health() -> Health:
    """The process answers."""
    return Health(status="ok")


@router.get("/ready", response_model=Health)
def read_readiness(services: ServicesOf) -> Health | JSONResponse:
    """The database answers, too, and so does the store of files; how full the disk is."""
    try:
        with services.database.reading() as session:
            session.execute(text("SELECT 1"))
    except SQLAlchemyError:
        return problem(503, "the database does not answer")
    try:
        services.store.has("nothing")
    except (BaseError, OSError):
        return problem(503, "the store of files does not answer")
    fullness = services.incoming.fullness()
    if fullness == "full":
        return problem(503, "the disk is full", "Make room on it.")
    return Health(status="ok" if fullness == "ok" else f"the disk is {fullness}")
