"""The operator's endpoints: for operators who proved lately who they are, and for no program."""

from __future__ import annotations

from datetime import timedelta

import httpx
import pytest
from gym.tests.accounts.test_gym_second_factor import NOON, in_half_a_minute, turned_on
from gym.tests.worlds import PASSWORD, Server, Somebody
from sqlalchemy import update

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.models import SignIn
from walltopo_gym.clock import now

PATH = "/operator/findings"


def code(answer: httpx.Response) -> str:
    found: str = answer.json().get("code", "")
    return found


def confirmed_before(server: Server, who: Somebody, minutes: int) -> None:
    with server.database.writing() as session:
        mine = update(SignIn).where(SignIn.person_id == who.id)
        session.execute(mine.values(confirmed_at=now() - timedelta(minutes=minutes)))


def test_an_operator_proves_again_who_they_are(server: Server) -> None:
    operator = server.person("operator")
    confirmed_before(server, operator, 14)
    assert server.ask("GET", PATH, operator).is_success
    confirmed_before(server, operator, 16)
    refused = server.ask("GET", PATH, operator)
    assert (refused.status_code, code(refused)) == (403, "confirm-operator")
    assert server.ask("POST", "/me/confirm", operator, {"password": "not mine"}).status_code == 403
    assert code(server.ask("GET", PATH, operator)) == "confirm-operator"
    assert server.ask("POST", "/me/confirm", operator, {"password": PASSWORD}).is_success
    assert server.ask("GET", PATH, operator).is_success


def test_the_second_factor_is_part_of_the_proof(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_half_a_minute(monkeypatch, 0)
    operator = server.person("operator")
    phone, _ = turned_on(server, operator)
    confirmed_before(server, operator, 16)
    alone = server.ask("POST", "/me/confirm", operator, {"password": PASSWORD})
    assert (alone.status_code, code(alone)) == (401, "second-factor-needed")
    body = {"password": PASSWORD, "code": "000000"}
    assert code(server.ask("POST", "/me/confirm", operator, body)) == "second-factor-wrong"
    assert code(server.ask("GET", PATH, operator)) == "confirm-operator"
    in_half_a_minute(monkeypatch, 1)
    body = {"password": PASSWORD, "code": phone.at(NOON + timedelta(seconds=30))}
    assert server.ask("POST", "/me/confirm", operator, body).status_code == 204
    assert server.ask("GET", PATH, operator).is_success


def test_digits_of_a_proof_cannot_be_tried_through(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_half_a_minute(monkeypatch, 0)
    operator = server.person("operator")
    turned_on(server, operator)
    statuses = [
        server.ask(
            "POST", "/me/confirm", operator, {"password": PASSWORD, "code": f"{number:06d}"}
        ).status_code
        for number in range(11)
    ]
    assert statuses[-1] == 429


def test_no_program_of_an_operator_is_let_in(server: Server) -> None:
    program = server.token(server.person("operator"), *Scope)
    refused = server.ask("GET", PATH, program)
    assert (refused.status_code, code(refused)) == (403, "token-never")


def test_a_browser_that_another_device_let_in_has_proved_nothing(server: Server) -> None:
    operator = server.person("operator")
    with server.database.writing() as session:
        mine = update(SignIn).where(SignIn.person_id == operator.id)
        session.execute(mine.values(confirmed_at=None))
    assert code(server.ask("GET", PATH, operator)) == "confirm-operator"
