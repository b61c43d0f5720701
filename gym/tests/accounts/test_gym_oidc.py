"""Signing in by another server: a provider of our own, whose answers are right or forged."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from authlib.oauth2.rfc7636 import create_s256_code_challenge
from fastapi import FastAPI
from fastapi.testclient import TestClient
from flask import Flask, Response, jsonify, redirect, request
from gym.tests.worlds import ORIGIN, Server
from joserfc import jwt
from joserfc.jwk import KeySet, RSAKey
from werkzeug.serving import make_server

from walltopo_gym.accounts import oidc
from walltopo_gym.server.app import PREFIX, build_app

KEY = RSAKey.generate_key(2048, {"kid": "1", "alg": "RS256", "use": "sig"})
FORGED = RSAKey.generate_key(2048, {"kid": "1", "alg": "RS256"})


@dataclass
class Provider:
    """Says of everybody that they are `claims`; `key` signs it."""

    address: str = ""
    claims: dict[str, Any] = field(default_factory=dict)
    key: RSAKey = field(default_factory=lambda: KEY)
    sign_ins: dict[str, dict[str, str]] = field(default_factory=dict)

    def app(self) -> Flask:
        app = Flask("provider")
        app.add_url_rule("/.well-known/openid-configuration", view_func=self.describe)
        app.add_url_rule("/keys", view_func=lambda: jsonify(KeySet([KEY]).as_dict(private=False)))
        app.add_url_rule("/authorize", view_func=self.authorize)
        app.add_url_rule("/token", view_func=self.token, methods=["POST"])
        return app

    def describe(self) -> Response:
        places = {
            "authorization_endpoint": "authorize",
            "token_endpoint": "token",
            "jwks_uri": "keys",
        }
        endpoints = {name: f"{self.address}/{path}" for name, path in places.items()}
        return jsonify(endpoints | {"issuer": self.address})

    def authorize(self) -> Any:
        code = f"code{len(self.sign_ins)}"
        self.sign_ins[code] = dict(request.args)
        return redirect(f"{request.args['redirect_uri']}?code={code}&state={request.args['state']}")

    def token(self) -> Response:
        sign_ins = self.sign_ins.pop(request.form["code"])
        assert sign_ins["code_challenge_method"] == "S256"
        shown = create_s256_code_challenge(request.form["code_verifier"])
        assert shown == sign_ins["code_challenge"]
        claims = {
            "iss": self.address,
            "aud": sign_ins["client_id"],
            "exp": int(time.time()) + 60,
            "iat": int(time.time()),
            "sub": "17",
            "nonce": sign_ins["nonce"],
            "email_verified": True,
        }
        id_token = jwt.encode({"alg": "RS256", "kid": "1"}, claims | self.claims, self.key)
        return jsonify({"access_token": "a", "token_type": "Bearer", "id_token": id_token})


_APPS: dict[tuple[Any, ...], FastAPI] = {}


@pytest.fixture(scope="module")
def running() -> Iterator[Provider]:
    provider = Provider()
    server = make_server("127.0.0.1", 0, provider.app(), threaded=True)
    provider.address = f"http://127.0.0.1:{server.server_port}"
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield provider
    server.shutdown()
    thread.join()


@pytest.fixture
def provider(running: Provider) -> Provider:
    running.claims, running.key = {}, KEY
    return running


def browser(server: Server, provider: Provider, **other: Any) -> TestClient:
    """At a server that has this provider."""
    ways = {
        "oidc_issuer": provider.address,
        "oidc_client_id": "walls",
        "oidc_client_secret": "s",
        "oidc_name": "Gym pass",
        **other,
    }
    # An application's first request takes a second.
    key = (server, *sorted(ways.items()))
    if key not in _APPS:
        settings = server.settings.model_copy(update=ways)
        _APPS[key] = build_app(replace(server.services, settings=settings))
    client = TestClient(_APPS[key], base_url=ORIGIN, follow_redirects=False)
    client.portal = server.portal
    return client


def come_back(client: TestClient) -> Any:
    """To the provider and back."""
    import requests

    gone = client.get("/oidc/sign-in")
    assert gone.status_code == 303
    sent = requests.get(gone.headers["location"], allow_redirects=False, timeout=600)
    back = urlsplit(sent.headers["location"])
    assert f"{back.scheme}://{back.netloc}" == ORIGIN
    return client.get(f"{back.path}?{back.query}")


def test_a_person_comes_in_by_it_and_is_the_same_the_next_time(
    server: Server, provider: Provider
) -> None:
    known = server.person()
    for email, subject in ((f"new.{id(server)}@example.com", "new"), (known.email, "known")):
        provider.claims = {"email": email, "sub": subject + str(id(server)), "name": "Ada"}
        ids = set()
        for turn in range(2):
            client = browser(server, provider, sign_up="open" if turn == 0 else "invitation")
            answer = come_back(client)
            assert (answer.status_code, answer.headers["location"]) == (303, "/sign-in/done"), (
                answer.text
            )
            me = client.get(f"{PREFIX}/me").json()
            assert me["email"] == email
            ids.add(me["id"])
            provider.claims["email"] = "changed@example.com"  # the subject is who it is
            provider.claims |= {"email": email}
        assert len(ids) == 1
    assert str(known.id) in ids


@pytest.mark.parametrize(
    ("claims", "status"),
    [
        ({"email_verified": False}, 403),
        ({"email": None}, 403),
        ({"nonce": "another"}, 401),
        ({"aud": "others"}, 401),
        ({"iss": "https://evil.example"}, 401),
        ({"exp": 1}, 401),
    ],
)
def test_an_answer_that_is_not_for_us_lets_nobody_in(
    server: Server, provider: Provider, claims: dict[str, Any], status: int
) -> None:
    provider.claims = {"email": server.person().email} | claims
    client = browser(server, provider)
    assert come_back(client).status_code == status
    assert client.get(f"{PREFIX}/me").status_code == 401


def test_a_forged_signature_lets_nobody_in(server: Server, provider: Provider) -> None:
    provider.claims, provider.key = {"email": server.person().email}, FORGED
    assert come_back(browser(server, provider)).status_code == 401


def test_who_has_no_account_needs_an_invitation_where_one_does(
    server: Server, provider: Provider
) -> None:
    provider.claims = {"email": "nobody.yet@example.com", "sub": "uninvited"}
    assert come_back(browser(server, provider, sign_up="invitation")).status_code == 403


def test_a_sign_in_that_another_browser_began_is_refused(
    server: Server, provider: Provider
) -> None:
    client = browser(server, provider)
    location = client.get("/oidc/sign-in").headers["location"]
    state = parse_qs(urlsplit(location).query)["state"][0]
    client.cookies.clear()
    answer = client.get(f"/oidc/callback?code=code0&state={state}")
    assert answer.status_code == 401


def test_without_a_provider_there_is_none(server: Server, provider: Provider) -> None:
    assert server.client().get("/oidc/sign-in").status_code == 404
    assert server.ask("GET", "/server").json()["oidc"] is None
    facts = browser(server, provider).get(f"{PREFIX}/server").json()
    assert facts["oidc"] == "Gym pass"


@pytest.mark.parametrize(
    ("name", "stored"),
    [
        ("Ada\r\nBcc: x@y.example", "Ada Bcc: x@y.example"),
        ("\x1b[2JAda\x00", "[2JAda"),
        ("\u202eadA", "adA"),
        (" \u200b ", "ada.name"),
        ("A" * 200, "A" * 80),
    ],
)
def test_a_providers_name_becomes_one_printable_line(
    server: Server, provider: Provider, name: str, stored: str
) -> None:
    email = f"ada.name+{len(server.outbox.mails)}.{abs(hash(name))}@example.com"
    provider.claims = {"email": email, "name": name, "sub": email}
    client = browser(server, provider)
    assert come_back(client).status_code == 303
    found = client.get(f"{PREFIX}/me").json()["name"]
    assert found == stored if stored != "ada.name" else found.startswith("ada.name+")


def test_the_document_of_a_provider_is_kept_and_requests_wait_for_no_other(
    server: Server, provider: Provider, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(oidc, "_DOCUMENTS", {})
    fetched = []
    get = oidc.Provider._get

    def counted(self: oidc.Provider, url: str) -> dict[str, Any]:
        fetched.append(url)
        return get(self, url)

    monkeypatch.setattr(oidc.Provider, "_get", counted)
    client = browser(server, provider)
    for _ in range(3):
        assert client.get("/oidc/sign-in").status_code == 303
    assert len(fetched) == 1


@pytest.mark.parametrize("bound", ["_MAX_BYTES", "_PATIENCE_S"])
def test_a_provider_that_sends_too_much_or_too_slowly_is_left(
    server: Server, provider: Provider, monkeypatch: pytest.MonkeyPatch, bound: str
) -> None:
    monkeypatch.setattr(oidc, "_DOCUMENTS", {})
    if bound == "_MAX_BYTES":
        monkeypatch.setattr(oidc, bound, 10)
    else:
        real = time.monotonic
        moments = iter([real(), real() + 10_000])
        monkeypatch.setattr(oidc, "time", SimpleNamespace(monotonic=lambda: next(moments)))
    answer = browser(server, provider).get("/oidc/sign-in")
    assert (answer.status_code, answer.json()["code"]) == (507, "provider-silent")


@pytest.mark.parametrize(("age_s", "status"), [(5, 201), (3600, 403), (None, 403)])
def test_only_a_fresh_sign_in_at_the_provider_confirms_who_one_is(
    server: Server, provider: Provider, age_s: int | None, status: int
) -> None:
    email = f"eva.{age_s}.{time.time_ns()}@example.com"
    provider.claims = {"email": email, "sub": email}
    if age_s is not None:
        provider.claims["auth_time"] = int(time.time()) - age_s
    client = browser(server, provider)
    assert "max_age=600" in client.get("/oidc/sign-in").headers["location"]
    assert come_back(client).status_code == 303
    made = client.post(f"{PREFIX}/me/tokens", json={"name": "t", "scopes": ["read"]})
    assert made.status_code == status, made.text


@pytest.mark.parametrize(
    ("audience", "party", "status"),
    [
        (["walls"], None, 303),
        (["walls", "other"], "walls", 303),
        (["walls", "other"], "other", 401),
        (["walls", "other"], None, 401),
    ],
)
def test_a_token_for_several_clients_names_us_as_the_one(
    server: Server, provider: Provider, audience: list[str], party: str | None, status: int
) -> None:
    email = f"azp.{time.time_ns()}@example.com"
    provider.claims = {"email": email, "sub": email, "aud": audience}
    provider.claims |= {} if party is None else {"azp": party}
    assert come_back(browser(server, provider)).status_code == status


@pytest.mark.parametrize("document", [[], {"issuer": 5}, {"authorization_endpoint": None}, "x"])
def test_a_providers_odd_document_is_no_defect(
    server: Server, provider: Provider, monkeypatch: pytest.MonkeyPatch, document: Any
) -> None:
    monkeypatch.setattr(oidc, "_DOCUMENTS", {})
    if isinstance(document, dict) and "issuer" not in document:
        document = document | {"issuer": provider.address}
    monkeypatch.setattr(oidc.Provider, "_get", lambda *_: document)
    answer = browser(server, provider).get("/oidc/sign-in")
    assert (answer.status_code, answer.json()["code"]) == (507, "provider-other")
