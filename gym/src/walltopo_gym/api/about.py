"""What a page has to know of this server before anybody has signed in."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_gym.api.rules import AnyoneMay
from walltopo_gym.api.services import ServicesOf

router = APIRouter(tags=["server"])


class ServerFacts(BaseModel):
    """How one gets in; `oidc`: what to call the other server, with its way in `/oidc/sign-in`."""

    sign_up: str
    new_gyms: str
    oidc: str | None


@router.get("/server")
def read_server(services: ServicesOf, actor: AnyoneMay) -> ServerFacts:
    """This server."""
    settings = services.settings
    return ServerFacts(
        sign_up=settings.sign_up,
        new_gyms=settings.new_gyms,
        oidc=settings.oidc_name if settings.oidc_issuer else None,
    )
