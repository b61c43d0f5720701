"""Endpoints of a gym's own network: whether the owner wants one, and how good it is."""

from __future__ import annotations

from datetime import datetime

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_gym.api.fields import Body
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.access import OwnerMay
from walltopo_gym.scans.own_network import OwnNetwork, switch_training
from walltopo_gym.scans.scan_out import NetworkResult

router = APIRouter(tags=["scans"])


class OwnNetworkOut(BaseModel):
    """A gym's own network. `offered`: the server trains networks; `wanted`: the owner wants one;
    `error`: why the last training failed."""

    offered: bool
    wanted: bool
    trained_at: datetime | None = None
    result: NetworkResult | None = None
    error: str = ""


class OwnNetworkChange(Body):
    """`wanted`: corrections of published walls train a network for this gym alone."""

    wanted: bool


@router.get("/gyms/{gym}/own-network")
def read_own_network(session: Db, services: ServicesOf, access: OwnerMay) -> OwnNetworkOut:
    """Return whether the gym has a network of its own, and how good it is."""
    return _network_out(session.get(OwnNetwork, access.gym.id), services.settings.own_networks)


@router.put("/gyms/{gym}/own-network")
def change_own_network(
    body: OwnNetworkChange, session: Db, services: ServicesOf, access: OwnerMay
) -> OwnNetworkOut:
    """Turn the nightly training on or off. Turned off, the gym's own network is deleted."""
    offered = services.settings.own_networks
    if body.wanted and not offered:
        raise ConflictError("own-networks-off", "ask-operator")
    row = switch_training(session, access.gym.id, body.wanted)
    access.log_change(
        session,
        "network.change",
        subject=access.gym.slug,
        wanted=body.wanted,
    )
    return _network_out(row, offered)


def _network_out(row: OwnNetwork | None, offered: bool) -> OwnNetworkOut:
    if row is None:
        return OwnNetworkOut(offered=offered, wanted=False)
    result = None if row.result is None else NetworkResult.model_validate(row.result)
    return OwnNetworkOut(
        offered=offered,
        wanted=row.wanted,
        trained_at=row.trained_at,
        result=result,
        error=row.error,
    )
