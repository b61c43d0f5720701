"""Signing in on a second device by a QR code: with a yes of the first one, once, and soon."""

from __future__ import annotations

from datetime import timedelta
from typing import Any

import pytest
from gym.tests.worlds import Server, Somebody
from sqlalchemy import update

from walltopo_gym.accounts.models import DeviceSignIn
from walltopo_gym.clock import now
from walltopo_gym.server.app import PREFIX


def offered(server: Server, who: Somebody) -> tuple[str, str]:
    """Path of the offer, and the secret in its QR code."""
    made = server.ask("POST", "/me/device-sign-ins", who).json()
    return f"/me/device-sign-ins/{made['id']}", made["link"].partition("#")[2]


def claimed(server: Server, secret: str) -> Any:
    return server.ask("POST", "/session/device-sign-in/claim", json={"secret": secret})


def test_the_first_device_says_yes_and_the_second_is_in_once(server: Server) -> None:
    somebody = server.person()
    path, secret = offered(server, somebody)
    phone = server.client()
    answer = claimed(server, secret).json()
    finish = f"{PREFIX}/session/device-sign-in"
    waiting = phone.post(finish, json={"secret": answer["claim"]})
    assert (waiting.json(), "set-cookie" in waiting.headers) == ({"me": None}, False)
    facts = server.ask("GET", path, somebody).json()
    assert (facts["code"], facts["allowed"]) == (answer["code"], False)
    assert server.ask("POST", f"{path}/allow", somebody, {"code": facts["code"]}).is_success
    entered = phone.post(finish, json={"secret": answer["claim"]})
    assert entered.json()["me"]["email"] == somebody.email
    assert phone.get(f"{PREFIX}/me").json()["email"] == somebody.email
    # Overheard, it is worth nothing.
    assert phone.post(finish, json={"secret": answer["claim"]}).status_code == 422
    assert claimed(server, secret).status_code == 422


def test_an_offer_is_taken_up_once_and_another_code_lets_nobody_in(server: Server) -> None:
    somebody, other = server.person(), server.person()
    path, secret = offered(server, somebody)
    thief = claimed(server, secret).json()
    assert claimed(server, secret).status_code == 422  # its owner notices
    other_code = "000000" if thief["code"] != "000000" else "000001"
    assert server.ask("POST", f"{path}/allow", somebody, {"code": other_code}).status_code == 422
    # Somebody else's browser can neither see nor allow it.
    assert server.ask("GET", path, other).status_code == 404
    body = {"code": thief["code"]}
    assert server.ask("POST", f"{path}/allow", other, body).status_code == 404
    waiting = server.ask("POST", "/session/device-sign-in", json={"secret": thief["claim"]})
    assert waiting.json() == {"me": None}
    # A new offer ends the old one.
    offered(server, somebody)
    gone = server.ask("POST", "/session/device-sign-in", json={"secret": thief["claim"]})
    assert gone.status_code == 422


@pytest.mark.parametrize("when", ["old", "signed out"])
def test_an_offer_ends(server: Server, when: str) -> None:
    somebody = server.person()
    path, secret = offered(server, somebody)
    if when == "old":
        with server.database.writing() as session:
            late = {"expires_at": now() - timedelta(seconds=1)}
            mine = DeviceSignIn.person_id == somebody.id
            session.execute(update(DeviceSignIn).where(mine).values(late))
    else:
        assert server.ask("DELETE", "/session", somebody).is_success
    assert claimed(server, secret).status_code == 422
    assert server.ask("GET", path, somebody).status_code in (401, 404)
