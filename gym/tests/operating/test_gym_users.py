"""An operator's page and command for accounts: find, lock, sign out, export, delete."""

from __future__ import annotations

import json
from typing import Any

import pytest
from gym.tests.accounts.test_gym_passkeys import added, options, signed_in
from gym.tests.accounts.test_gym_second_factor import in_half_a_minute, turned_on
from gym.tests.authenticator import Device
from gym.tests.operating.test_gym_operator_page import command, logged
from gym.tests.worlds import ORIGIN, PASSWORD, Server, Somebody, World

from walltopo_gym.accounts.actor import Scope


@pytest.fixture
def operator(server: Server) -> Somebody:
    return server.person("operator")


def act(
    server: Server,
    operator: Somebody,
    who: Somebody,
    method: str,
    path: str,
    body: object = None,
) -> Any:
    answer = server.ask(method, f"/operator/users/{who.id}/{path}", operator, body)
    assert answer.is_success, answer.text
    return answer.json() if answer.content else None


def found(server: Server, operator: Somebody, text: str) -> list[dict[str, Any]]:
    answer = server.ask("GET", f"/operator/users?search={text}", operator)
    assert answer.is_success, answer.text
    rows: list[dict[str, Any]] = answer.json()["items"]
    return rows


def subjects(server: Server, who: Somebody) -> list[str]:
    return [mail.subject for mail in server.outbox.mails if mail.to == who.email]


def sign_in_code(server: Server, who: Somebody) -> str:
    answer = server.ask("POST", "/session", json={"email": who.email, "password": PASSWORD})
    return "" if answer.is_success else str(answer.json()["code"])


def test_accounts_are_found_by_name_and_address(world: World, operator: Somebody) -> None:
    server = world.server
    who = server.person("Zdenka 100% Žižka")
    (row,) = found(server, operator, "100%25 ")
    assert (row["id"], row["email"]) == (str(who.id), who.email)
    assert (row["operator"], row["locked_at"], row["browsers"]) == (False, None, 1)
    (owner,) = found(server, operator, world.owner.email)
    assert owner["gyms"] == [{"gym": world.gym.slug, "role": "owner"}]
    assert found(server, operator, "nobody@nowhere") == []
    first = server.ask("GET", "/operator/users?size=1", operator).json()
    second = server.ask("GET", f"/operator/users?size=1&cursor={first['next']}", operator).json()
    assert first["items"][0]["id"] != second["items"][0]["id"]


def test_a_locked_account_is_shut_and_keeps_its_data(world: World, operator: Somebody) -> None:
    server, member, device = world.server, world.people["member"], Device(ORIGIN)
    assert added(server, member, device).is_success
    program = server.token(member, *Scope)
    path = f"{world.path}/walls"
    assert server.ask("GET", path, program).is_success
    act(server, operator, member, "PUT", "lock")
    assert server.ask("GET", "/me", member).status_code == 401
    assert server.ask("GET", path, program).status_code == 401
    assert sign_in_code(server, member) == "account-locked"
    assert signed_in(server, device.sign(options(server))).status_code == 403
    (row,) = found(server, operator, member.email)
    assert row["locked_at"] is not None
    assert row["gyms"] == [{"gym": world.gym.slug, "role": "member"}]
    act(server, operator, member, "DELETE", "lock")
    assert sign_in_code(server, member) == ""
    assert server.ask("GET", path, program).is_success
    assert subjects(server, member)[1:] == ["Your account was locked", "Your account is unlocked"]
    done = [("user.lock", str(member.id)), ("user.unlock", str(member.id))]
    assert logged(server, operator) == done


def test_a_wrong_password_does_not_reveal_a_locked_account(
    server: Server, operator: Somebody
) -> None:
    who = server.person()
    act(server, operator, who, "PUT", "lock")
    body = {"email": who.email, "password": "not the password"}
    assert server.ask("POST", "/session", json=body).json()["code"] == "sign-in-wrong"


def test_somebody_is_signed_out_everywhere(server: Server, operator: Somebody) -> None:
    who = server.person()
    act(server, operator, who, "POST", "sign-out")
    assert server.ask("GET", "/me", who).status_code == 401
    assert sign_in_code(server, who) == ""
    assert subjects(server, who) == ["You were signed out everywhere"]


def test_a_lost_second_factor_is_reset(
    server: Server, operator: Somebody, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_half_a_minute(monkeypatch, 0)
    who = server.person()
    turned_on(server, who)
    assert found(server, operator, who.email)[0]["second_factor"]
    assert sign_in_code(server, who) == "second-factor-needed"
    act(server, operator, who, "POST", "second-factor/reset")
    assert sign_in_code(server, who) == ""
    assert not found(server, operator, who.email)[0]["second_factor"]
    assert subjects(server, who)[-1] == "Two-factor authentication was reset"


def test_an_export_is_what_the_owner_gets(world: World, operator: Somebody) -> None:
    server, member = world.server, world.people["member"]
    own = server.ask("GET", "/me/data", member).json()
    assert act(server, operator, member, "POST", "data") == own
    assert subjects(server, member) == ["Your data was exported"]
    assert logged(server, operator) == [("user.export", str(member.id))]


def test_an_account_is_deleted_after_its_address_was_typed(
    world: World, operator: Somebody
) -> None:
    server, who = world.server, world.people["stranger"]
    path = f"/operator/users/{who.id}/delete"
    other = server.ask("POST", path, operator, {"email": operator.email})
    assert (other.status_code, other.json()["code"]) == (422, "user-other-email")
    assert server.ask("POST", path, operator, {"email": who.email.upper()}).status_code == 204
    assert found(server, operator, who.email) == []
    assert subjects(server, who) == ["Your account was deleted"]
    assert server.ask("POST", path, operator, {"email": who.email}).status_code == 404
    last = server.ask(
        "POST",
        f"/operator/users/{world.owner.id}/delete",
        operator,
        {"email": world.owner.email},
    )
    assert (last.status_code, last.json()["code"]) == (409, "gym-without-owner")
    assert subjects(server, world.owner) == []


def test_an_operator_neither_locks_nor_deletes_themself(server: Server, operator: Somebody) -> None:
    path = f"/operator/users/{operator.id}"
    for method, what, body in (
        ("PUT", "lock", None),
        ("POST", "delete", {"email": operator.email}),
    ):
        refused = server.ask(method, f"{path}/{what}", operator, body)
        assert (refused.status_code, refused.json()["code"]) == (403, "operator-self")
    assert server.ask("GET", "/me", operator).is_success


def test_the_command_does_what_the_page_does(
    world: World, operator: Somebody, capsys: pytest.CaptureFixture[str]
) -> None:
    server, member = world.server, world.people["member"]
    assert command(server, "user", "find", member.email) == 0
    assert member.email in capsys.readouterr().out
    assert command(server, "user", "lock", member.email) == 0
    assert sign_in_code(server, member) == "account-locked"
    assert command(server, "user", "find", member.email) == 0
    assert "member locked" in capsys.readouterr().out
    assert command(server, "user", "unlock", member.email) == 0
    assert sign_in_code(server, member) == ""
    assert command(server, "user", "sign-out", member.email) == 0
    assert found(server, operator, member.email)[0]["browsers"] == 0
    assert command(server, "user", "no-second-factor", member.email) == 0
    capsys.readouterr()
    assert command(server, "user", "export", member.email) == 0
    assert json.loads(capsys.readouterr().out)["account"]["email"] == member.email
    assert command(server, "user", "delete", member.email) == 0
    assert found(server, operator, member.email) == []
    assert command(server, "user", "lock", member.email) != 0
