"""Passkeys: added and used by a device, and by nobody else."""

from __future__ import annotations

from typing import Any

import httpx
import pytest
from gym.tests.authenticator import Device, text
from gym.tests.worlds import ORIGIN, Server, Somebody

from walltopo_gym.server.app import PREFIX


def added(server: Server, who: Somebody, device: Device) -> httpx.Response:
    options = server.ask("POST", "/me/passkeys/options", who).json()
    body = {"name": "phone", "credential": device.make(options)}
    return server.ask("POST", "/me/passkeys", who, body)


def options(server: Server) -> dict[str, Any]:
    given: dict[str, Any] = server.ask("POST", "/session/passkey/options").json()
    return given


def signed_in(server: Server, credential: dict[str, Any]) -> httpx.Response:
    return server.ask("POST", "/session/passkey", json={"credential": credential})


def test_a_device_signs_in_without_a_password(server: Server) -> None:
    somebody, device = server.person(), Device(ORIGIN)
    assert added(server, somebody, device).status_code == 201
    browser = server.client()
    options_given = browser.post(f"{PREFIX}/session/passkey/options").json()
    assert options_given.get("allowCredentials", []) == []  # tells of no account
    body = {"credential": device.sign(options_given)}
    answer = browser.post(f"{PREFIX}/session/passkey", json=body)
    assert answer.status_code == 200, answer.text
    assert browser.get(f"{PREFIX}/me").json()["email"] == somebody.email
    # Overheard, it is worth nothing.
    assert browser.post(f"{PREFIX}/session/passkey", json=body).status_code == 401
    kept = server.ask("GET", "/me/passkeys", somebody).json()
    assert [(key["name"], key["used_at"] is not None) for key in kept] == [("phone", True)]
    path = f"/me/passkeys/{kept[0]['id']}"
    assert server.ask("DELETE", path, somebody).status_code == 204
    assert signed_in(server, device.sign(options(server))).status_code == 401


def test_who_has_not_the_key_is_not_let_in(server: Server) -> None:
    somebody, device, thief = server.person(), Device(ORIGIN), Device(ORIGIN)
    assert added(server, somebody, device).status_code == 201
    thief.id = device.id
    assert signed_in(server, thief.sign(options(server))).status_code == 401
    phisher = Device("https://walls.example.net")
    assert added(server, somebody, phisher).status_code == 422
    device.origin = phisher.origin
    assert signed_in(server, device.sign(options(server))).status_code == 401


def test_a_challenge_is_valid_for_its_requester_only(server: Server) -> None:
    one, other, device = server.person(), server.person(), Device(ORIGIN)
    options_given = server.ask("POST", "/me/passkeys/options", one).json()
    body = {"name": "phone", "credential": device.make(options_given)}
    assert server.ask("POST", "/me/passkeys", other, body).status_code == 422
    assert server.ask("POST", "/me/passkeys", one, body).status_code == 201


def test_a_device_that_does_not_know_its_owner_is_not_enough(server: Server) -> None:
    assert added(server, server.person(), Device(ORIGIN, verifies=False)).status_code == 422


NESTED = {"response": {"clientDataJSON": text(b"[" * 200_000)}}


@pytest.mark.parametrize(
    "credential", [{}, {"response": 3}, {"response": {"clientDataJSON": "%"}}, NESTED]
)
def test_nonsense_is_refused(server: Server, credential: dict[str, Any]) -> None:
    assert signed_in(server, credential).status_code == 401
    body = {"name": "phone", "credential": credential}
    assert server.ask("POST", "/me/passkeys", server.person(), body).status_code == 422
