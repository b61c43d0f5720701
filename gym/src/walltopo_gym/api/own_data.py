"""One's own data: out as a file, and away."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response
from starlette.responses import PlainTextResponse

from walltopo_gym.api.cookies import end_here
from walltopo_gym.api.fields import Body, Password
from walltopo_gym.api.own_password import check_own_password
from walltopo_gym.api.rules import SignedInMay
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.climbing.own_data import all_of, ascents_csv, forget
from walltopo_gym.hall.models import KINDS

router = APIRouter(tags=["accounts"])


class Farewell(Body):
    """The password once more: nobody goes by a browser that was left open."""

    password: Password


@router.get("/me/data")
def read_data(response: Response, session: Db, actor: SignedInMay) -> dict[str, Any]:
    """All that is kept of one, whole."""
    response.headers["content-disposition"] = 'attachment; filename="walltopo.json"'
    return all_of(session, actor.known, KINDS)


@router.get("/me/ascents.csv", response_class=PlainTextResponse)
def read_ascents_table(session: Db, actor: SignedInMay) -> PlainTextResponse:
    """One's ascents as a table."""
    headers = {"content-disposition": 'attachment; filename="ascents.csv"'}
    return PlainTextResponse(
        ascents_csv(session, actor.known), headers=headers, media_type="text/csv"
    )


@router.post("/me/delete", status_code=204)
def delete_me(body: Farewell, response: Response, services: ServicesOf, actor: SignedInMay) -> None:
    """Delete one's account with all that one did."""
    check_own_password(services, actor.known, body.password)
    with services.database.writing() as session:
        forget(session, actor.known)
    end_here(response)
