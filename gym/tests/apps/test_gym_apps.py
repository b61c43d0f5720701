"""Apps of others: registration, consent, tokens, and attacks on each of them."""

from __future__ import annotations

from base64 import b64encode
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from functools import partial
from uuid import UUID

import pytest
from gym.tests.apps.consent import (
    REDIRECT,
    VERIFIER,
    AppOf,
    bearer,
    challenge_of,
    fields_of,
    register,
)
from gym.tests.worlds import ORIGIN, PASSWORD, Server, Somebody, World
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import select, update
from tests.at_once import at_once

from walltopo_gym.accounts import limits
from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.models import (
    ApiToken,
    App,
    AppConnection,
    AppGrant,
    AppRefreshToken,
    AuditEntry,
    Person,
    SignIn,
)
from walltopo_gym.apps.redirects import is_registered
from walltopo_gym.apps.registry import drop_expired
from walltopo_gym.clock import now
from walltopo_gym.events import RowsExpired
from walltopo_gym.operating.own_data import all_of


@pytest.fixture
def app(world: World) -> AppOf:
    return register(world.server, world.people["stranger"])


def log_status(world: World, who: Somebody) -> int:
    """Return the status of reading one's own logbook of the gym."""
    return world.server.ask("GET", f"{world.path}/logbook", who).status_code


def connected(world: World, who: Somebody) -> list[dict[str, object]]:
    rows: list[dict[str, object]] = world.server.ask("GET", "/me/connected-apps", who).json()
    return rows


def test_an_app_reads_a_logbook_until_it_is_disconnected(world: World, app: AppOf) -> None:
    member = world.people["member"]
    answer = app.approve(member)
    assert (answer["state"], answer["iss"]) == ("s1", ORIGIN)
    made = app.redeem(answer["code"])
    assert made.headers["cache-control"] == "no-store"
    tokens = made.json()
    assert (tokens["token_type"], tokens["expires_in"]) == ("Bearer", 3600)
    assert tokens["scope"] == "read"
    assert log_status(world, bearer(tokens)) == 200
    (row,) = connected(world, member)
    assert (row["name"], row["maker"], row["scopes"]) == ("Log", "stranger", ["read"])
    assert row["used_at"] is not None
    path = f"/me/connected-apps/{row['id']}"
    assert world.server.ask("DELETE", path, world.people["judge"]).status_code == 404
    assert world.server.ask("DELETE", path, member).status_code == 204
    assert log_status(world, bearer(tokens)) == 401
    assert app.refresh(tokens["refresh_token"]).json()["error"] == "invalid_grant"
    assert connected(world, member) == []


def test_no_secret_is_stored(world: World, app: AppOf) -> None:
    answer = app.approve(world.people["member"])
    tokens = app.redeem(answer["code"]).json()
    secrets = {app.secret, answer["code"], tokens["access_token"], tokens["refresh_token"]}
    with world.server.database.reading() as session:
        for kind in (App, AppConnection, AppGrant, AppRefreshToken, ApiToken, AuditEntry):
            text = repr([vars(row) for row in session.scalars(select(kind))])
            assert not [secret for secret in secrets if secret in text], kind
    owner = world.people["stranger"].id
    assert owner is not None
    with world.server.database.reading() as session:
        assert "password_hash" not in repr(all_of(session, owner)["apps"])


def test_a_persons_data_name_their_apps(world: World, app: AppOf) -> None:
    app.connect(world.people["member"])
    data = world.server.ask("GET", "/me/data", world.people["member"]).json()
    assert [row["app_id"] for row in data["app_connections"]] == [app.id]


WRONG = {
    "another redirect address": {"redirect_uri": "https://evil.example/done"},
    "a longer redirect address": {"redirect_uri": REDIRECT + "/more"},
    "a redirect address with a query": {"redirect_uri": REDIRECT + "?a=1"},
    "a redirect address in capitals": {"redirect_uri": REDIRECT.replace("log", "LOG")},
    "a redirect address with a user": {"redirect_uri": "https://log.example@evil.example/done"},
    "no known app": {"client_id": "00000000-0000-0000-0000-000000000000"},
    "no id": {"client_id": "log"},
}


@pytest.mark.parametrize("changes", WRONG.values(), ids=WRONG)
def test_nobody_is_sent_to_an_unknown_address(app: AppOf, changes: dict[str, str]) -> None:
    who = app.server.person()
    for path in ("/me/authorizations/check", "/me/authorizations"):
        answer = app.server.ask("POST", path, who, {"query": app.query(**changes)})
        assert answer.status_code == 422
        assert "address" not in answer.json()
    twice = app.query() + "&redirect_uri=https://evil.example/done"
    assert app.check(who, twice).status_code == 422


REFUSED: dict[str, tuple[dict[str, str | None], str]] = {
    "the implicit grant": ({"response_type": "token"}, "unsupported_response_type"),
    "no PKCE": ({"code_challenge": None, "code_challenge_method": None}, "invalid_request"),
    "plain PKCE": ({"code_challenge_method": "plain"}, "invalid_request"),
    "a short challenge": ({"code_challenge": "abc"}, "invalid_request"),
    "an unknown scope": ({"scope": "read everything"}, "invalid_scope"),
    "another server": ({"resource": "https://evil.example/mcp"}, "invalid_target"),
}


@pytest.mark.parametrize(("changes", "error"), REFUSED.values(), ids=REFUSED)
def test_the_app_learns_what_is_wrong(
    app: AppOf, changes: dict[str, str | None], error: str
) -> None:
    who = app.server.person()
    body = app.check(who, app.query(**changes)).json()
    assert body["consent"] is None
    fields = fields_of(body["address"])
    assert (fields["error"], fields["state"], fields["iss"]) == (error, "s1", ORIGIN)
    assert "code" not in app.approve(who, **changes)


def test_a_field_that_comes_twice_is_refused(app: AppOf) -> None:
    body = app.check(app.server.person(), app.query() + "&scope=manage").json()
    assert fields_of(body["address"])["error"] == "invalid_request"


def test_a_person_reads_what_an_app_wants(world: World, app: AppOf) -> None:
    member = world.people["member"]
    app.connect(member)
    wider = app.check(member, app.query(scope="read publish")).json()["consent"]
    assert (wider["name"], wider["maker"], wider["target"]) == ("Log", "stranger", "log.example")
    assert (wider["scopes"], wider["known"]) == (["read", "publish"], ["read"])
    declined = fields_of(wider["declined"])
    assert (declined["error"], declined["state"]) == ("access_denied", "s1")
    assert connected(world, member)[0]["scopes"] == ["read"]  # nothing was allowed by looking


def test_a_code_is_good_once_and_a_second_use_ends_its_tokens(world: World, app: AppOf) -> None:
    code = app.approve(world.people["member"])["code"]
    tokens = app.redeem(code).json()
    other = app.connect(world.people["member"])
    assert app.redeem(code).json()["error"] == "invalid_grant"
    assert log_status(world, bearer(tokens)) == 401
    assert app.refresh(tokens["refresh_token"]).status_code == 400
    assert log_status(world, bearer(other)) == 200  # of another consent


def test_of_two_uses_of_a_code_at_once_one_gets_tokens(world: World, app: AppOf) -> None:
    code = app.approve(world.people["member"])["code"]
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(lambda _: app.redeem(code).status_code, range(4)))
    assert sorted(answers) == [200, 400, 400, 400]


def test_of_two_uses_of_a_refresh_token_at_once_one_gets_tokens(world: World, app: AppOf) -> None:
    secret = app.connect(world.people["member"])["refresh_token"]
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(lambda _: app.refresh(secret).status_code, range(4)))
    assert sorted(answers) == [200, 400, 400, 400]


def test_a_code_is_good_for_a_minute(world: World, app: AppOf) -> None:
    code = app.approve(world.people["member"])["code"]
    with world.server.database.writing() as session:
        session.execute(update(AppGrant).values(expires_at=now() - timedelta(seconds=1)))
    assert app.redeem(code).json()["error"] == "invalid_grant"


BAD_CODES: dict[str, tuple[dict[str, str | None], str]] = {
    "another verifier": ({"code_verifier": "w" * 43}, "invalid_grant"),
    "no verifier": ({"code_verifier": None}, "invalid_request"),
    "another redirect address": ({"redirect_uri": "https://log.example/"}, "invalid_grant"),
    "another secret": ({"client_secret": "wtgs_wrong"}, "invalid_client"),
    "no secret": ({"client_secret": None}, "invalid_client"),
    "no client": ({"client_id": None}, "invalid_client"),
    "the password grant": ({"grant_type": "password"}, "unsupported_grant_type"),
    "no grant": ({"grant_type": None}, "invalid_request"),
}


@pytest.mark.parametrize(("changes", "error"), BAD_CODES.values(), ids=BAD_CODES)
def test_a_code_alone_is_worth_nothing(
    world: World, app: AppOf, changes: dict[str, str | None], error: str
) -> None:
    code = app.approve(world.people["member"])["code"]
    answer = app.redeem(code, **changes)
    assert answer.json()["error"] == error
    assert answer.status_code == (401 if error == "invalid_client" else 400)
    assert app.redeem(code).status_code == 200  # the app itself still can


def test_a_code_and_a_refresh_token_are_of_one_app(world: World, app: AppOf) -> None:
    other = register(world.server, world.people["judge"], name="Other")
    code = app.approve(world.people["member"])["code"]
    assert other.redeem(code).json()["error"] == "invalid_grant"
    tokens = app.redeem(code).json()
    assert other.refresh(tokens["refresh_token"]).json()["error"] == "invalid_grant"
    for name in ("access_token", "refresh_token"):
        assert other.post("revoke", token=tokens[name]).status_code == 200
    assert log_status(world, bearer(tokens)) == 200
    assert app.refresh(tokens["refresh_token"]).status_code == 200


def test_a_refresh_token_used_twice_ends_all_that_came_from_it(world: World, app: AppOf) -> None:
    first = app.connect(world.people["member"])
    second = app.refresh(first["refresh_token"]).json()
    assert log_status(world, bearer(second)) == 200
    assert app.refresh(first["refresh_token"]).json()["error"] == "invalid_grant"
    assert app.refresh(second["refresh_token"]).json()["error"] == "invalid_grant"
    assert {log_status(world, bearer(one)) for one in (first, second)} == {401}
    with world.server.database.reading() as session:
        is_it = AuditEntry.action == "app.reuse", AuditEntry.person_id == world.people["member"].id
        assert session.scalars(select(AuditEntry).where(*is_it)).one()


def test_scopes_never_grow_by_refreshing(world: World, app: AppOf) -> None:
    tokens = app.connect(world.people["setter"], scope="read upload")
    wider = app.refresh(tokens["refresh_token"], scope="read manage")
    assert wider.json()["error"] == "invalid_scope"
    narrow = app.refresh(tokens["refresh_token"], scope="read").json()
    assert narrow["scope"] == "read"
    path = f"{world.path}/webhooks"
    assert world.server.ask("GET", path, bearer(narrow)).status_code == 403
    again = app.refresh(narrow["refresh_token"]).json()
    assert again["scope"] == "read upload"


def test_the_scope_of_an_app_is_checked_as_that_of_a_token(world: World, app: AppOf) -> None:
    path = f"{world.path}/webhooks"
    reading, managing = (app.connect(world.owner, scope=scope) for scope in ("read", "manage"))
    assert world.server.ask("GET", path, bearer(reading)).json()["code"] == "token-lacks-scope"
    assert world.server.ask("GET", path, bearer(managing)).status_code == 200


def test_an_app_cannot_do_what_a_browser_may(world: World, app: AppOf) -> None:
    program = bearer(app.connect(world.owner, scope="read upload publish manage"))
    for method, path in (
        ("GET", "/me"),
        ("GET", "/me/apps"),
        ("GET", "/me/connected-apps"),
        ("POST", "/me/authorizations"),
        ("POST", "/me/tokens"),
        ("GET", "/me/data"),
    ):
        answer = world.server.ask(method, path, program, {"query": app.query()})
        assert answer.status_code in (403, 422), path
        assert answer.status_code == 403 or method == "POST"
    made = world.server.ask("POST", "/me/tokens", program, {"name": "t", "scopes": ["read"]})
    assert made.json()["code"] == "token-never"


def test_an_app_ends_its_own_tokens(world: World, app: AppOf) -> None:
    member = world.people["member"]
    tokens = app.connect(member)
    assert app.post("revoke", token=tokens["access_token"]).status_code == 200
    assert log_status(world, bearer(tokens)) == 401
    tokens = app.refresh(tokens["refresh_token"]).json()
    hint = {"token_type_hint": "access_token"}  # wrong, and only a hint
    assert app.post("revoke", token=tokens["refresh_token"], **hint).status_code == 200
    assert log_status(world, bearer(tokens)) == 401
    assert connected(world, member) == []
    assert app.post("revoke", token="unknown").status_code == 200
    assert app.post("revoke", token="unknown", client_secret="x").status_code == 401


def test_an_app_cannot_end_a_token_that_a_person_made(world: World, app: AppOf) -> None:
    own = world.server.token(world.owner, Scope.READ)
    secret = own.headers["authorization"].removeprefix("Bearer ")
    assert app.post("revoke", token=secret).status_code == 200
    assert world.server.ask("GET", world.path, own).status_code == 200


def test_a_locked_account_lets_no_app_in(world: World, app: AppOf) -> None:
    member = world.people["member"]
    tokens = app.connect(member)
    lock = update(Person).where(Person.id == member.id)
    with world.server.database.writing() as session:
        session.execute(lock.values(locked_at=now()))
    assert log_status(world, bearer(tokens)) == 401
    assert app.refresh(tokens["refresh_token"]).json()["error"] == "invalid_grant"
    with world.server.database.writing() as session:
        session.execute(lock.values(locked_at=None))
    assert app.refresh(tokens["refresh_token"]).status_code == 200


def test_an_app_of_a_locked_maker_is_of_no_use(server: Server) -> None:
    maker, member = server.person(), server.person()
    app = register(server, maker)
    tokens = app.connect(member)
    lock = update(Person).where(Person.id == maker.id)
    with server.database.writing() as session:
        session.execute(lock.values(locked_at=now()))
    assert server.ask("GET", "/gyms", bearer(tokens)).status_code == 401
    assert app.refresh(tokens["refresh_token"]).json()["error"] == "invalid_client"
    assert app.check(member, app.query()).json()["code"] == "app-unknown"
    own = server.token(member, Scope.READ)  # the person's own tokens go on
    assert server.ask("GET", "/gyms", own).status_code == 200


def status_of_refresh(app: AppOf, secret: str) -> int:
    return app.refresh(secret).status_code


def status_of_disconnecting(server: Server, who: Somebody, path: str) -> int:
    return server.ask("DELETE", path, who).status_code


def test_an_app_that_refreshes_all_the_time_keeps_nobody_from_disconnecting_it(
    server: Server,
) -> None:
    app, member = register(server, server.person()), server.person()
    for _ in range(5):
        tokens = app.connect(member)
        secret = tokens["refresh_token"]
        [connection] = server.ask("GET", "/me/connected-apps", member).json()
        path = f"/me/connected-apps/{connection['id']}"
        answers = at_once(
            *4 * [partial(status_of_refresh, app, secret)],
            partial(status_of_disconnecting, server, member, path),
        )
        # A second use of the refresh token ends the connection, too, and may do so first.
        assert answers[-1] in {204, 404}
        assert server.ask("GET", "/me/connected-apps", member).json() == []
        assert set(answers[:-1]) <= {200, 400}


def test_used_refresh_tokens_go_and_new_ones_have_a_limit(
    world: World, app: AppOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "_REFRESHES", limits.Limit("app-refresh", 3, 3600))
    secret = app.connect(world.people["member"])["refresh_token"]
    secret = app.refresh(secret).json()["refresh_token"]
    week = now() - timedelta(days=8)
    ours = AppRefreshToken.grant_id.in_(
        select(AppGrant.id)
        .join(AppConnection, AppConnection.id == AppGrant.connection_id)
        .where(AppConnection.app_id == UUID(app.id))
    )
    with world.server.database.writing() as session:
        old = update(AppRefreshToken).where(ours, AppRefreshToken.used_at.is_not(None))
        session.execute(old.values(used_at=week))
    last = app.refresh(secret)
    assert last.status_code == 200
    with world.server.database.reading() as session:
        moments = session.scalars(select(AppRefreshToken.used_at).where(ours)).all()
    assert len(moments) == 2  # the one just used, and the new one
    assert week not in moments
    assert app.refresh(last.json()["refresh_token"]).status_code == 429


@pytest.mark.parametrize("verifier", ["v", "v" * 42, "v" * 129, "ä" * 43])
def test_a_verifier_has_the_form_of_the_standard(world: World, app: AppOf, verifier: str) -> None:
    code = app.approve(world.people["member"], code_challenge=challenge_of(verifier))["code"]
    assert app.redeem(code, code_verifier=verifier).json()["error"] == "invalid_grant"


@pytest.mark.parametrize("address", ["com.example.app:///done", "https://log.example/a?b=c"])
def test_an_answer_goes_to_the_registered_address_letter_by_letter(
    server: Server, address: str
) -> None:
    app = register(server, server.person(), redirects=[address])
    body = {"query": app.query(redirect_uri=address)}
    answer = server.ask("POST", "/me/authorizations", server.person(), body)
    assert answer.json()["address"].startswith(address + ("&" if "?" in address else "?"))


def test_a_new_password_disconnects_all_apps(server: Server) -> None:
    app, who = register(server, server.person()), server.person()
    tokens = app.connect(who)
    body = {"old": PASSWORD, "new": "another chalk bucket 9"}
    assert server.ask("PUT", "/me/password", who, body).status_code == 204
    assert app.refresh(tokens["refresh_token"]).status_code == 400
    assert server.ask("GET", "/gyms", bearer(tokens)).status_code == 401


def test_with_an_account_go_its_connections_and_its_apps(server: Server) -> None:
    maker, one, other = (server.person() for _ in range(3))
    app = register(server, maker)
    tokens = [app.connect(who) for who in (one, other)]
    delete = {"password": PASSWORD}
    assert server.ask("POST", "/me/delete", one, delete).is_success
    assert app.refresh(tokens[0]["refresh_token"]).status_code == 400
    assert server.ask("GET", "/gyms", bearer(tokens[1])).status_code == 200
    assert server.ask("POST", "/me/delete", maker, delete).is_success
    assert server.ask("GET", "/gyms", bearer(tokens[1])).status_code == 401
    assert app.refresh(tokens[1]["refresh_token"]).json()["error"] == "invalid_client"


def test_consent_needs_a_fresh_proof_and_is_mailed(server: Server) -> None:
    app, who = register(server, server.person()), server.person()
    app.connect(who)
    assert server.outbox.mails[-1].to == who.email
    assert "Log" in server.outbox.mails[-1].text
    old = update(SignIn).where(SignIn.person_id == who.id)
    with server.database.writing() as session:
        session.execute(old.values(confirmed_at=now() - timedelta(minutes=11)))
    body = {"query": app.query()}
    answer = server.ask("POST", "/me/authorizations", who, body)
    assert answer.json()["code"] == "confirm-first"


def test_no_other_site_consents_for_a_person(server: Server) -> None:
    app, who = register(server, server.person()), server.person()
    for other in ({"sec-fetch-site": "cross-site"}, {"origin": "https://evil.example"}):
        body = {"query": app.query()}
        answer = server.ask("POST", "/me/authorizations", who, body, headers=other)
        assert answer.json()["code"] == "other-site"
    page = server.client().get("/oauth/authorize" + app.query())
    assert page.status_code == 200
    assert page.headers["content-security-policy"].endswith("frame-ancestors 'none'")
    assert page.headers["referrer-policy"] == "same-origin"


def test_a_public_client_on_a_device_listens_on_any_port(server: Server) -> None:
    redirects = ["http://127.0.0.1/done", "com.example.log:/done"]
    app = register(server, server.person(), redirects=redirects, confidential=False)
    assert app.secret == ""
    who = server.person()
    for redirect in ("http://127.0.0.1:51004/done", "com.example.log:/done"):
        code = app.approve(who, redirect_uri=redirect)["code"]
        assert app.redeem(code, redirect_uri=redirect).status_code == 200
    code = app.approve(who, redirect_uri=redirects[1])["code"]
    assert app.redeem(code, client_secret="x", redirect_uri=None).status_code == 401
    for wrong in (
        "http://127.0.0.1:51004/other",
        "http://localhost/done",
        "https://127.0.0.1/done",
    ):
        assert app.check(who, app.query(redirect_uri=wrong)).status_code == 422


@given(st.text(max_size=40))
def test_no_text_after_an_address_makes_it_a_registered_one(more: str) -> None:
    known = ["https://log.example/done", "http://127.0.0.1/done"]
    for address in known:
        assert is_registered(address + more, known) == (not more)


@pytest.mark.parametrize(
    "address",
    [
        "http://log.example/done",
        "https://log.example/done#part",
        "https://log.example\\@evil.example/",
        "https://user@log.example/",
        "https:///done",
        "javascript:alert(1)",
        "data:text/html,x",
        "log:/done",
        "/done",
        "https://log.example:99999/",
        "http://127.0.0.1.evil.example/",
        "https://log.example/a b",
        "http://[::1/",
    ],
)
def test_unsafe_redirect_addresses_cannot_be_registered(server: Server, address: str) -> None:
    body = {"name": "Log", "home_page": "https://log.example/", "redirects": [address]}
    answer = server.ask("POST", "/me/apps", server.person(), body)
    assert answer.json()["code"] == "app-redirect"


def test_a_home_page_is_a_web_page(server: Server) -> None:
    body = {"name": "Log", "home_page": "", "redirects": [REDIRECT]}
    for page, status in (
        ("javascript:alert(1)", 422),
        ("https://walls.example.com@evil.example/", 422),
        ("https://social.example/@log", 201),
    ):
        answer = server.ask("POST", "/me/apps", server.person(), body | {"home_page": page})
        assert answer.status_code == status, page


def test_a_developer_changes_an_app_and_its_secret(server: Server) -> None:
    maker, who = server.person(), server.person()
    app = register(server, maker)
    tokens = app.connect(who)
    path = f"/me/apps/{app.id}"
    body = {"name": "New", "home_page": "https://log.example/", "redirects": [REDIRECT + "2"]}
    assert server.ask("PUT", path, who, body).status_code == 404
    assert server.ask("PUT", path, maker, body).json()["name"] == "New"
    assert app.check(who, app.query()).status_code == 422  # to the old address
    secret = server.ask("POST", f"{path}/secret", maker).json()["secret"]
    assert app.refresh(tokens["refresh_token"]).status_code == 401
    newer = AppOf(server, app.id, secret)
    assert newer.refresh(tokens["refresh_token"]).status_code == 200
    assert server.ask("DELETE", path, maker).status_code == 204
    assert server.ask("GET", "/gyms", bearer(tokens)).status_code == 401


def test_a_public_app_has_no_secret(server: Server) -> None:
    maker = server.person()
    app = register(server, maker, confidential=False)
    answer = server.ask("POST", f"/me/apps/{app.id}/secret", maker)
    assert answer.json()["code"] == "app-public"


def test_a_client_may_send_its_secret_in_the_header(world: World, app: AppOf) -> None:
    code = app.approve(world.people["member"])["code"]
    form = {"grant_type": "authorization_code", "code": code, "code_verifier": VERIFIER}

    def post(sent: str, **more: str) -> int:
        basic = {"authorization": f"Basic {b64encode(sent.encode()).decode()}"}
        browser = world.server.client()
        answer = browser.post("/oauth/token", data=form | more, headers=basic)
        assert answer.status_code != 401 or answer.headers["www-authenticate"].startswith("Basic")
        return answer.status_code

    assert post(f"{app.id}:wrong") == 401
    assert post("no colon") == 401
    assert post(f"{app.id}:{app.secret}", client_secret=app.secret) == 400
    assert post(f"{app.id}:{app.secret}", client_id="another") == 400
    assert post(f"{app.id}:{app.secret}") == 200


def test_odd_bodies_are_refused_in_the_words_of_oauth(server: Server) -> None:
    client = server.client()
    form = {"content-type": "application/x-www-form-urlencoded"}
    for body, headers in (
        (b'{"grant_type": "refresh_token"}', {"content-type": "application/json"}),
        (b"\xff\xfe=1", form),
        (b"grant_type=a&grant_type=b", form),
        (b"&".join(b"a%d=1" % n for n in range(50)), form),
        (b"", form),
    ):
        answer = client.post("/oauth/token", content=body, headers=headers)
        assert answer.status_code == 400
        assert answer.json()["error"] == "invalid_request"


def test_requests_for_tokens_are_limited(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "_APP_TOKENS", limits.Limit("app-token", 2, 900))
    app = register(server, server.person())
    answers = [app.refresh("wtgr_guess") for _ in range(3)]
    assert [answer.status_code for answer in answers] == [400, 400, 429]
    assert answers[-1].headers["retry-after"] == "900"


def test_a_person_registers_a_limited_number_of_apps(server: Server) -> None:
    maker = server.person()
    for _ in range(20):
        register(server, maker)
    body = {"name": "Log", "home_page": "https://log.example/", "redirects": [REDIRECT]}
    assert server.ask("POST", "/me/apps", maker, body).json()["code"] == "apps-most"


def test_programs_find_the_server(server: Server) -> None:
    client = server.client()
    found = client.get("/.well-known/oauth-authorization-server").json()
    assert found["issuer"] == ORIGIN
    assert found["code_challenge_methods_supported"] == ["S256"]
    for name in ("token", "revocation"):
        assert client.post(found[f"{name}_endpoint"].removeprefix(ORIGIN)).status_code == 400
    resource = client.get("/.well-known/oauth-protected-resource/mcp").json()
    assert resource["resource"] == f"{ORIGIN}/mcp"
    assert resource["authorization_servers"] == [ORIGIN]
    assert client.get("/.well-known/none").status_code == 404


def test_a_page_of_another_origin_gets_tokens_and_reads(world: World) -> None:
    """As browsers do it: they ask first, and send no cookie."""
    app = register(world.server, world.people["stranger"], confidential=False)
    other = {"origin": "https://log.example", "sec-fetch-site": "cross-site"}
    client = world.server.client()
    code = app.approve(world.people["member"])["code"]
    form = {
        "grant_type": "authorization_code",
        "client_id": app.id,
        "code": code,
        "code_verifier": VERIFIER,
    }
    made = client.post("/oauth/token", data=form, headers=other)
    assert made.headers["access-control-allow-origin"] == "*"
    program = bearer(made.json())
    path = f"/api/v1{world.path}/logbook"
    wanted = {
        "access-control-request-method": "GET",
        "access-control-request-headers": "authorization",
    }
    preflight = client.options(path, headers=other | wanted)
    assert preflight.status_code == 204
    assert "authorization" in preflight.headers["access-control-allow-headers"]
    answer = client.get(path, headers=other | program.headers)
    assert (answer.status_code, answer.headers["access-control-allow-origin"]) == (200, "*")


def test_expired_grants_go(world: World, app: AppOf) -> None:
    app.connect(world.people["member"])
    app.approve(world.people["judge"])
    with world.server.database.writing() as session:
        session.execute(update(AppGrant).values(expires_at=now() - timedelta(days=1)))
    with world.server.database.writing() as session:
        question = RowsExpired()
        drop_expired(session, question)
    assert sum(question.found) >= 4
    with world.server.database.reading() as session:
        left = select(AppConnection).where(AppConnection.app_id == UUID(app.id))
        assert session.scalars(left).all() == []


def test_the_challenge_is_that_of_the_standard() -> None:
    """RFC 7636, appendix B."""
    verifier = "dBjftJeZ4CVP-mB92K27uhbUJU1p1r_wW1gFWFOEjXk"
    assert challenge_of(verifier) == "E9Melhoa2OwvFrEMTJguCHaoeK1t8URWbuGJSstw-cM"


def test_an_odd_link_is_refused(server: Server) -> None:
    app = register(server, server.person())
    query = "&".join(f"a{n}=1" for n in range(50))
    answer = app.check(server.person(), query)
    assert answer.json()["code"] == "app-request-odd"
