"""The second factor: asked for, good once, and the way back in without the phone."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import httpx
import pyotp
import pytest
from gym.tests.worlds import PASSWORD, Server, Somebody

from walltopo_gym.accounts import second_factor

NOON = datetime(2026, 3, 4, 12, tzinfo=UTC)


@pytest.fixture(autouse=True)
def _clock_stands_still(monkeypatch: pytest.MonkeyPatch) -> None:
    in_half_a_minute(monkeypatch, 0)


def sign_in(server: Server, who: Somebody, code: str | None = None) -> httpx.Response:
    answer = {"email": who.email, "password": PASSWORD} | ({"code": code} if code else {})
    return server.ask("POST", "/session", json=answer)


def turned_on(server: Server, who: Somebody) -> tuple[pyotp.TOTP, list[str]]:
    begun = server.ask("POST", "/me/second-factor", who).json()
    phone = pyotp.parse_uri(begun["uri"])
    assert isinstance(phone, pyotp.TOTP)
    assert (phone.secret, phone.name) == (begun["secret"], who.email)
    answer = server.ask("POST", "/me/second-factor/confirm", who, {"code": phone.at(NOON)})
    assert answer.status_code == 200, answer.text
    codes: list[str] = answer.json()["recovery_codes"]
    return phone, codes


def in_half_a_minute(monkeypatch: pytest.MonkeyPatch, steps: int) -> None:
    later = NOON + timedelta(seconds=30 * steps)
    monkeypatch.setattr(second_factor, "now", lambda: later)


def test_the_password_alone_lets_nobody_in(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    who = server.person()
    assert sign_in(server, who).status_code == 200
    phone, _ = turned_on(server, who)
    alone = sign_in(server, who)
    assert (alone.status_code, alone.headers.get("set-cookie")) == (401, None)
    in_half_a_minute(monkeypatch, 1)
    code = phone.at(NOON + timedelta(seconds=30))
    assert sign_in(server, who, code).status_code == 200
    # Seen over somebody's shoulder, it is good no more.
    assert sign_in(server, who, code).status_code == 401
    assert sign_in(server, who, "000000").status_code == 401
    in_half_a_minute(monkeypatch, 9)
    assert sign_in(server, who, code).status_code == 401


def test_a_wrong_password_does_not_reveal_a_second_factor(server: Server) -> None:
    who = server.person()
    turned_on(server, who)
    answer = server.ask("POST", "/session", json={"email": who.email, "password": "wrong password"})
    assert answer.json()["title"] == "wrong email or password"


def test_a_recovery_code_is_good_once(server: Server) -> None:
    who = server.person()
    _, codes = turned_on(server, who)
    assert len(set(codes)) == 10
    assert sign_in(server, who, codes[0].upper()).status_code == 200
    assert sign_in(server, who, codes[0]).status_code == 401
    left = server.ask("GET", "/me/second-factor", who).json()
    assert left == {"on": True, "recovery_codes_left": 9}


def test_digits_cannot_be_tried_through(server: Server) -> None:
    who = server.person()
    turned_on(server, who)
    statuses = [sign_in(server, who, f"{number:06d}").status_code for number in range(10)]
    assert statuses[-1] == 429


def test_it_takes_effect_after_its_digits_were_shown(server: Server) -> None:
    who = server.person()
    server.ask("POST", "/me/second-factor", who)
    assert sign_in(server, who).status_code == 200
    wrong = server.ask("POST", "/me/second-factor/confirm", who, {"code": "123456"})
    assert wrong.status_code == 422


def test_turning_it_off_wants_the_password(server: Server) -> None:
    who = server.person()
    turned_on(server, who)
    off = "/me/second-factor/off"
    assert server.ask("POST", off, who, {"password": "not mine, surely"}).status_code == 403
    assert server.ask("POST", off, who, {"password": PASSWORD}).status_code == 204
    assert sign_in(server, who).status_code == 200
    # The export had the second factor while it was on, without its secret.
    turned_on(server, who)
    kept = server.ask("GET", "/me/data", who).json()
    assert len(kept["recovery_codes"]) == 10
    assert kept["second_factor"][0].keys() == {"id", "created_at", "last_step", "confirmed_at"}
