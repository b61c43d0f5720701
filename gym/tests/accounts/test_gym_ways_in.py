"""Ways to sign in change after their owner is confirmed, with a mail, and end by a reset."""

from __future__ import annotations

from datetime import timedelta
from typing import Any, get_args
from uuid import UUID

import httpx
import pytest
from gym.tests.accounts.test_gym_passkeys import added, options, signed_in
from gym.tests.authenticator import Device
from gym.tests.worlds import ORIGIN, PASSWORD, Server, Somebody
from sqlalchemy import update

from walltopo_gym.accounts.mails import mail_templates, new_link
from walltopo_gym.accounts.models import Identity, SignIn
from walltopo_gym.accounts.notices import Change
from walltopo_gym.clock import now
from walltopo_gym.languages import LANGUAGES
from walltopo_gym.server.app import PREFIX

NEW = "another chalk bucket 9"
CHANGES: tuple[tuple[str, str, dict[str, Any] | None], ...] = (
    ("POST", "/me/passkeys/options", None),
    ("POST", "/me/passkeys", {"name": "phone", "credential": {}}),
    ("DELETE", f"/me/passkeys/{UUID(int=1)}", None),
    ("POST", "/me/second-factor", None),
    ("POST", "/me/second-factor/confirm", {"code": "123456"}),
    ("POST", "/me/tokens", {"name": "t", "scopes": ["read"]}),
    ("DELETE", f"/me/tokens/{UUID(int=1)}", None),
)


def signed_in_long_ago(server: Server) -> Somebody:
    who = server.person()
    with server.database.writing() as session:
        old = update(SignIn).where(SignIn.person_id == who.id)
        session.execute(old.values(confirmed_at=now() - timedelta(minutes=11)))
    return who


def code(answer: httpx.Response) -> str:
    found: str = answer.json().get("code", "") if answer.content else ""
    return found


@pytest.mark.parametrize(("method", "path", "body"), CHANGES)
def test_a_found_browser_changes_no_way_to_sign_in(
    server: Server, method: str, path: str, body: dict[str, Any] | None
) -> None:
    who = signed_in_long_ago(server)
    refused = server.ask(method, path, who, body)
    assert (refused.status_code, code(refused)) == (403, "confirm-first")
    wrong = server.ask("POST", "/me/confirm", who, {"password": "not the password"})
    assert wrong.status_code == 403
    assert code(server.ask(method, path, who, body)) == "confirm-first"
    assert server.ask("POST", "/me/confirm", who, {"password": PASSWORD}).status_code == 204
    assert code(server.ask(method, path, who, body)) != "confirm-first"


def test_a_passkey_confirms_too_but_only_ones_own(server: Server) -> None:
    who, device = server.person(), Device(ORIGIN)
    stranger, strange = server.person(), Device(ORIGIN)
    assert added(server, who, device).is_success
    assert added(server, stranger, strange).is_success
    with server.database.writing() as session:
        session.execute(update(SignIn).where(SignIn.person_id == who.id).values(confirmed_at=None))
    body = {"credential": strange.sign(options(server))}
    assert server.ask("POST", "/me/confirm/passkey", who, body).status_code == 422
    assert code(server.ask("POST", "/me/second-factor", who)) == "confirm-first"
    body = {"credential": device.sign(options(server))}
    assert server.ask("POST", "/me/confirm/passkey", who, body).status_code == 204
    assert server.ask("POST", "/me/second-factor", who).is_success


def test_a_browser_that_another_device_let_in_has_proved_nothing(server: Server) -> None:
    who, other = signed_in_long_ago(server), server.client()
    offered = server.ask("POST", "/me/device-sign-ins", who).json()
    secret = offered["link"].partition("#")[2]
    claimed = other.post(f"{PREFIX}/session/device-sign-in/claim", json={"secret": secret}).json()
    path = f"/me/device-sign-ins/{offered['id']}/allow"
    assert server.ask("POST", path, who, {"code": claimed["code"]}).is_success
    body = {"secret": claimed["claim"]}
    assert other.post(f"{PREFIX}/session/device-sign-in", json=body).json()["me"] is not None
    refused = other.post(f"{PREFIX}/me/tokens", json={"name": "t", "scopes": ["read"]})
    assert (refused.status_code, code(refused)) == (403, "confirm-first")


def reset_link(server: Server, who: Somebody) -> str:
    with server.database.writing() as session:
        return new_link(session, "reset", who.email)


def test_a_reset_removes_all_other_ways_in_but_those_that_are_kept(server: Server) -> None:
    who, own, thiefs = server.person(), Device(ORIGIN), Device(ORIGIN)
    kept = added(server, who, own).json()["id"]
    added(server, who, thiefs)
    with server.database.writing() as session:
        session.add(Identity(person_id=who.id, issuer="https://id.example", subject="17"))
    token = reset_link(server, who)
    ways = server.ask("POST", "/password-reset/ways-in", json={"token": token}).json()
    assert sorted(way["kind"] for way in ways) == ["passkey", "passkey", "provider"]
    assert kept in {way["id"] for way in ways}
    body = {"token": token, "password": NEW, "keep": [kept]}
    assert server.ask("POST", "/password-reset/confirm", json=body).status_code == 204
    assert server.ask("POST", "/password-reset/ways-in", json={"token": token}).status_code == 422
    assert signed_in(server, own.sign(options(server))).status_code == 200
    assert signed_in(server, thiefs.sign(options(server))).status_code == 401
    again = {"token": reset_link(server, who), "password": NEW + "a"}
    assert server.ask("POST", "/password-reset/confirm", json=again).status_code == 204
    assert signed_in(server, own.sign(options(server))).status_code == 401


def test_a_change_of_the_password_removes_what_is_not_kept(server: Server) -> None:
    who, one, other = server.person(), Device(ORIGIN), Device(ORIGIN)
    added(server, who, one)
    kept = added(server, who, other).json()["id"]
    body = {"old": PASSWORD, "new": NEW, "keep": [kept]}
    assert server.ask("PUT", "/me/password", who, body).status_code == 204
    assert signed_in(server, one.sign(options(server))).status_code == 401
    assert signed_in(server, other.sign(options(server))).status_code == 200


def test_the_owner_gets_a_mail_about_each_change_in_their_language(server: Server) -> None:
    who, device = server.person(), Device(ORIGIN)

    def mails() -> list[str]:
        return [mail.text for mail in server.outbox.mails if mail.to == who.email]

    made = added(server, who, device).json()["id"]
    assert 'passkey "phone" was added' in mails()[-1]
    german = who.headers | {"accept-language": "de-AT,en;q=0.5"}
    given = server.ask("DELETE", f"/me/passkeys/{made}", Somebody(who.id, who.email, german))
    assert given.status_code == 204
    assert "Passkey „phone“ wurde" in mails()[-1]
    token = server.ask("POST", "/me/tokens", who, {"name": "cron", "scopes": ["read"]}).json()
    server.ask("DELETE", f"/me/tokens/{token['id']}", who)
    server.ask("POST", "/me/second-factor/off", who, {"password": PASSWORD})
    body = {"token": reset_link(server, who), "password": NEW}
    server.ask("POST", "/password-reset/confirm", json=body)
    assert len(mails()) == 6
    assert all("/new-password" in text for text in mails())
    fresh = server.person()
    server.ask("POST", "/me/delete", fresh, {"password": PASSWORD})
    assert [mail.subject for mail in server.outbox.mails if mail.to == fresh.email] == [
        "Your account was deleted"
    ]


def test_every_change_has_a_mail_in_every_language() -> None:

    for language in LANGUAGES:
        for change in (*get_args(Change), "changed"):
            assert mail_templates()[language][change]["text"]
