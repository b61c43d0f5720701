"""Signing up, in and out, as a browser does it."""

from __future__ import annotations

import itertools
import re
from contextlib import suppress
from datetime import timedelta
from uuid import uuid4

import pytest
from argon2 import PasswordHasher
from fastapi.testclient import TestClient
from gym.tests.worlds import ORIGIN, PASSWORD, Server, World
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import delete, select, update
from starlette.requests import Request
from zxcvbn.frequency_lists import FREQUENCY_LISTS

from walltopo_gym.accounts.access import COOKIE
from walltopo_gym.accounts.leaked import SHORTEST, is_leaked, marks_of
from walltopo_gym.accounts.models import MailedLink, Person, SignIn, Try
from walltopo_gym.accounts.passwords import LONGEST, Passwords, check_password
from walltopo_gym.accounts.secrets import hash_of
from walltopo_gym.api.services import network_of
from walltopo_gym.clock import now
from walltopo_gym.errors import RequestError
from walltopo_gym.languages import LANGUAGES
from walltopo_gym.server.app import PREFIX

NEW = {"name": "Ada", "password": PASSWORD}


def new_address(name: str) -> str:
    """Return an address that no test has used on this server."""
    return f"{name}.{uuid4().hex}@example.com"


def signed_up(server: Server, email: str) -> str:
    """Ask for an account; the secret that was mailed."""
    assert server.ask("POST", "/sign-up", json={"email": email}).status_code == 202
    return server.outbox.secret_for(email)


def test_from_the_first_mail_to_signed_out(server: Server) -> None:
    browser, email = server.client(), new_address("ada")
    token = signed_up(server, email)
    answer = browser.post(f"{PREFIX}/sign-up/confirm", json=NEW | {"token": token})
    assert answer.status_code == 201, answer.text
    cookie = answer.headers["set-cookie"]
    assert cookie.startswith(COOKIE + "=")
    for word in ("Secure", "HttpOnly", "Path=/", "SameSite=lax"):
        assert word in cookie
    assert "Domain" not in cookie
    assert browser.get(f"{PREFIX}/me").json()["email"] == email
    ended = browser.delete(f"{PREFIX}/session")
    assert (ended.status_code, ended.headers["clear-site-data"]) == (204, '"cache"')
    assert browser.get(f"{PREFIX}/me").status_code == 401
    again = {"email": email.replace("ada", "ADA"), "password": PASSWORD}
    assert browser.post(f"{PREFIX}/session", json=again).status_code == 200
    assert browser.get(f"{PREFIX}/me").json()["name"] == "Ada"


def test_a_cookie_that_was_stolen_ends_with_the_sign_in(server: Server) -> None:
    somebody = server.person()
    assert server.ask("DELETE", "/me/sessions", somebody).status_code == 204
    assert server.ask("GET", "/me", somebody).status_code == 401


def test_a_sign_in_ends_by_itself(server: Server) -> None:
    somebody = server.person()
    with server.database.writing() as session:
        late = update(SignIn).where(SignIn.person_id == somebody.id)
        session.execute(late.values(expires_at=now() - timedelta(seconds=1)))
    assert server.ask("GET", "/me", somebody).status_code == 401


def test_nothing_tells_whether_an_address_has_an_account(server: Server) -> None:
    """Answers are equal; the mail alone, which its owner reads, tells."""
    known, unknown = server.person().email, "nobody.knows@example.com"
    for path in ("/sign-up", "/password-reset"):
        answers = [server.ask("POST", path, json={"email": email}) for email in (known, unknown)]
        assert answers[0].status_code == answers[1].status_code == 202
        assert answers[0].content == answers[1].content
    wrong = [
        server.ask("POST", "/session", json={"email": email, "password": "not the password"})
        for email in (known, unknown)
    ]
    assert wrong[0].status_code == wrong[1].status_code == 401
    assert wrong[0].content == wrong[1].content
    subjects = {mail.to: mail.subject for mail in server.outbox.mails}
    assert subjects[known] == "Reset your password"
    assert subjects[unknown] == "No account found"


def test_mails_are_in_the_requesters_language(server: Server) -> None:
    known, unknown = server.person().email, "other.tongue@example.com"
    seen = set()
    for language in LANGUAGES:
        for path in ("/sign-up", "/password-reset"):
            for email in (known, unknown):
                request = {"email": email, "language": language}
                assert server.ask("POST", path, json=request).status_code == 202
                mail = server.outbox.mails[-1]
                assert mail.to == email
                seen.add((mail.subject, mail.text.splitlines()[0]))
                assert f"{ORIGIN}/" in mail.text
        with server.database.writing() as session:  # three mails an address in an hour
            session.execute(delete(Try))
    assert len(seen) == 4 * len(LANGUAGES)


def test_a_mailed_link_is_good_once_and_for_a_while(server: Server) -> None:
    token = signed_up(server, new_address("once"))
    body = NEW | {"token": token}
    assert server.ask("POST", "/sign-up/confirm", json=body).status_code == 201
    assert server.ask("POST", "/sign-up/confirm", json=body).status_code == 422
    late = signed_up(server, new_address("late"))
    with server.database.writing() as session:
        row = update(MailedLink).where(MailedLink.token_hash == hash_of(late))
        session.execute(row.values(expires_at=now() - timedelta(seconds=1)))
    assert server.ask("POST", "/sign-up/confirm", json=NEW | {"token": late}).status_code == 422


def test_a_new_password_ends_all_that_the_old_one_began(server: Server) -> None:
    somebody = server.person()
    made = server.ask("POST", "/me/tokens", somebody, {"name": "t", "scopes": ["read"]}).json()
    program = {"authorization": f"Bearer {made['secret']}"}
    assert server.ask("GET", "/gyms", headers=program).status_code == 200
    assert server.ask("POST", "/password-reset", json={"email": somebody.email}).status_code == 202
    token = server.outbox.secret_for(somebody.email)
    body = {"token": token, "password": "tall slab without holds"}
    assert server.ask("POST", "/password-reset/confirm", json=body).status_code == 204
    assert server.ask("GET", "/me", somebody).status_code == 401
    assert server.ask("GET", "/gyms", headers=program).status_code == 401
    for password, status in ((PASSWORD, 401), (body["password"], 200)):
        given = {"email": somebody.email, "password": password}
        assert server.ask("POST", "/session", json=given).status_code == status


def test_guessing_is_stopped_and_shuts_the_owner_out_of_nothing(server: Server) -> None:
    somebody = server.person()
    right = {"email": somebody.email, "password": PASSWORD}
    own, elsewhere = server.client(), server.client()
    assert own.post(f"{PREFIX}/session", json=right).status_code == 200
    own.cookies.delete(COOKIE)
    wrong = right | {"password": "not the password"}
    statuses = [elsewhere.post(f"{PREFIX}/session", json=wrong).status_code for _ in range(10)]
    assert statuses == [401] * 9 + [429]  # the first one was the owner's own
    answer = elsewhere.post(f"{PREFIX}/session", json=right)
    assert answer.status_code == 429
    assert int(answer.headers["retry-after"]) > 0
    # One who is signed in is not shut out by others' guesses, nor one who signed in here before.
    assert server.ask("GET", "/me", somebody).status_code == 200
    assert own.post(f"{PREFIX}/session", json=right).status_code == 200
    # The browser is known for its own account, and its tries are counted, too.
    other = right | {"email": server.person().email}
    assert own.post(f"{PREFIX}/session", json=other | {"password": "x" * 12}).status_code == 401
    statuses = [own.post(f"{PREFIX}/session", json=wrong).status_code for _ in range(10)]
    assert statuses[-1] == 429


def test_a_mailed_link_lets_a_blocked_owner_in(server: Server) -> None:
    somebody = server.person()
    wrong = {"email": somebody.email, "password": "not the password"}
    new = server.client()
    assert [new.post(f"{PREFIX}/session", json=wrong).status_code for _ in range(11)][-1] == 429
    server.ask("POST", "/password-reset", json={"email": somebody.email})
    body = {"token": server.outbox.secret_for(somebody.email), "password": "tall slab no holds 3"}
    assert new.post(f"{PREFIX}/password-reset/confirm", json=body).status_code == 204
    right = wrong | {"password": body["password"]}
    assert new.post(f"{PREFIX}/session", json=right).status_code == 200


def ask_mail(server: Server, path: str, email: str, network: str = "192.0.2.1") -> int:
    """Have a mail sent, from somewhere; the status."""
    client = TestClient(server.app, base_url=ORIGIN, client=(network, 1))
    return client.post(f"{PREFIX}/{path}", json={"email": email}).status_code


def test_mails_that_others_ask_for_block_no_reset(server: Server) -> None:
    email = server.person().email
    statuses = [ask_mail(server, "sign-up", email) for _ in range(4)]
    assert statuses == [202] * 3 + [429]
    assert ask_mail(server, "password-reset", email) == 202
    # Reset requests from one network use up that network's limit.
    while ask_mail(server, "password-reset", email) == 202:
        pass
    assert ask_mail(server, "password-reset", email, "198.51.100.7") == 202
    # From many networks a mailbox is still not flooded.
    request = [ask_mail(server, "password-reset", email, f"203.0.113.{n}") for n in range(30)]
    assert 429 in request
    assert request.count(202) < 10


def test_a_network_that_asks_for_many_mails_blocks_no_reset_and_no_known_browser(
    server: Server,
) -> None:
    somebody = server.person()
    own = server.client()
    right = {"email": somebody.email, "password": PASSWORD}
    assert own.post(f"{PREFIX}/session", json=right).status_code == 200
    numbers = itertools.count()
    for path in ("sign-up", "password-reset"):
        if path == "password-reset":
            assert ask_mail(server, path, "other@example.com", "testclient") == 202
        while ask_mail(server, path, f"flood.{next(numbers)}@example.com", "testclient") == 202:
            assert next(numbers) < 1_000
    own.cookies.delete(COOKIE)
    reset = {"email": somebody.email}
    statuses = [own.post(f"{PREFIX}/password-reset", json=reset).status_code for _ in range(20)]
    assert statuses[0] == 202
    assert statuses[-1] == 429  # its own mails are counted, too


@pytest.mark.parametrize(
    ("sender", "network"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("2001:db8:1:2:3::4", "2001:db8:1:2::/64"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("testclient", "testclient"),
    ],
)
def test_a_household_is_one_network(sender: str, network: str) -> None:
    assert network_of(Request({"type": "http", "client": (sender, 1)})) == network


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"sec-fetch-site": "cross-site"}, 403),
        ({"sec-fetch-site": "same-site"}, 403),
        ({"sec-fetch-site": "same-origin"}, 200),
        ({"origin": "https://evil.example"}, 403),
        ({"origin": "null"}, 403),
        ({"origin": ORIGIN}, 200),
        ({}, 200),
    ],
)
def test_another_sites_page_changes_nothing(
    server: Server, headers: dict[str, str], status: int
) -> None:
    somebody = server.person()
    answer = server.ask("PATCH", "/me", somebody, {"name": "Changed"}, headers)
    assert answer.status_code == status
    with server.database.reading() as session:
        name = session.scalar(select(Person.name).where(Person.id == somebody.id))
    assert (name == "Changed") == (status == 200)


def test_no_secret_stands_in_the_database(server: Server) -> None:
    somebody = server.person()
    made = server.ask("POST", "/me/tokens", somebody, {"name": "t", "scopes": ["read"]}).json()
    secrets = [made["secret"], somebody.headers["cookie"].partition("=")[2], PASSWORD]
    with server.database.engine.connect() as connection:
        for table in ("people", "sign_ins", "api_tokens", "mailed_links", "audit"):
            written = str(connection.exec_driver_sql(f"SELECT * FROM {table}").all())
            assert [secret for secret in secrets if secret in written] == []


def test_the_last_use_of_an_invitation_is_one_persons(world: World) -> None:
    made = world.server.ask("POST", f"{world.path}/invitations", world.owner, {"role": "setter"})
    body = {"secret": made.json()["secret"]}
    first, second = world.server.person(), world.server.person()
    answer = world.server.ask("POST", "/invitations/accept", first, body)
    assert (answer.status_code, answer.json()["role"]) == (200, "setter")
    assert world.server.ask("POST", "/invitations/accept", second, body).status_code == 422
    assert world.server.ask("GET", world.path, second).status_code == 404


def test_a_password_is_the_same_however_a_keyboard_composes_it() -> None:
    passwords = Passwords()
    typed = "Gr\u00fcner\u00a0Griff am Felsen"
    apart = "Gru\u0308ner Griff am Felsen"
    assert passwords.matches(passwords.hash(typed), apart)
    assert passwords.matches(passwords.hash(apart), typed)
    # A hash from before, of what macOS typed.
    assert passwords.matches(PasswordHasher().hash(apart), typed.replace("\u00a0", " "))
    assert not passwords.matches(passwords.hash(typed), "Gruner Griff am Felsen")
    assert not passwords.matches(None, typed)


def test_passwords_are_kept_by_argon2id() -> None:
    passwords = Passwords()
    kept = passwords.hash(PASSWORD)
    assert re.match(r"\$argon2id\$v=19\$m=(\d+)", kept)
    assert passwords.matches(kept, PASSWORD)
    assert not passwords.matches(kept, PASSWORD + " ")
    assert not passwords.matches(None, "nobody has this")


@pytest.mark.parametrize(
    "password", ["short", "password1234", "qwertyuiop", "1234567890", "adaadaada1", "aaaaaaaaaaaa"]
)
def test_a_password_that_is_guessed_soon_is_refused(password: str) -> None:
    with pytest.raises(RequestError, match="password"):
        check_password(password, "ada@gym.example", "Ada")


@pytest.mark.parametrize("password", ["vjhtctdthf", "Usuckballz1", "uSuCkBaLlZ1", "qwertyuiop"])
def test_a_password_that_leaked_is_refused(password: str) -> None:
    with pytest.raises(RequestError, match="leaks"):
        check_password(password, "ada@gym.example", "Ada")


def test_the_commonest_passwords_are_among_those_that_leaked() -> None:
    # An independent list of leaked ones, of which each can be chosen here.
    common = [word for word in FREQUENCY_LISTS["passwords"] if len(word) >= SHORTEST]
    assert len(common) > 1000
    assert [word for word in common if not is_leaked(word)] == []
    assert not is_leaked(PASSWORD)


@given(st.lists(st.text(max_size=12)), st.integers(0, 12))
def test_of_a_list_of_leaked_passwords_long_ones_are_kept_once(
    leaked: list[str], shortest: int
) -> None:
    marks = marks_of(leaked, shortest)
    long = {each.casefold() for each in leaked if len(each) >= shortest}
    each = [marks[at : at + 5] for at in range(0, len(marks), 5)]
    assert len(each) == len(long)
    assert each == sorted(each)


@given(st.text(min_size=0, max_size=LONGEST + 5))
def test_any_password_is_taken_or_refused_in_words(password: str) -> None:
    with suppress(RequestError):
        check_password(password, "ada@gym.example")
