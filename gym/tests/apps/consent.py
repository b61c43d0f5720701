"""An app of others as its developer and its people use it, for tests."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

import httpx
from gym.tests.worlds import Server, Somebody

VERIFIER = "v" * 43
REDIRECT = "https://log.example/done"


def challenge_of(verifier: str) -> str:
    digest = hashlib.sha256(verifier.encode()).digest()
    return base64.urlsafe_b64encode(digest).decode().rstrip("=")


@dataclass(frozen=True)
class AppOf:
    """A registered app.

    Parameters
    ----------
    secret : empty for a public client.
    """

    server: Server
    id: str
    secret: str

    def query(self, **changes: str | None) -> str:
        """Return the query of its link to the consent page; None leaves a field out."""
        fields: dict[str, str | None] = {
            "response_type": "code",
            "client_id": self.id,
            "redirect_uri": REDIRECT,
            "scope": "read",
            "state": "s1",
            "code_challenge": challenge_of(VERIFIER),
            "code_challenge_method": "S256",
        }
        return "?" + urlencode({k: v for k, v in (fields | changes).items() if v is not None})

    def check(self, who: Somebody, query: str) -> httpx.Response:
        path = "/me/authorizations/check"
        return self.server.ask("POST", path, who, {"query": query})

    def approve(self, who: Somebody, **changes: str | None) -> dict[str, str]:
        """Return the fields that the app gets after a person's consent."""
        body = {"query": self.query(**changes)}
        answer = self.server.ask("POST", "/me/authorizations", who, body)
        assert answer.status_code == 201, answer.text
        return fields_of(answer.json()["address"])

    def post(self, path: str, **fields: str | None) -> httpx.Response:
        """Send a form to an endpoint of OAuth; None leaves a field out."""
        own = {"client_id": self.id} | ({"client_secret": self.secret} if self.secret else {})
        form = {name: text for name, text in (own | fields).items() if text is not None}
        return self.server.client().post(f"/oauth/{path}", data=form)

    def redeem(self, code: str, **changes: str | None) -> httpx.Response:
        fields: dict[str, str | None] = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": REDIRECT,
            "code_verifier": VERIFIER,
        }
        return self.post("token", **(fields | changes))

    def refresh(self, secret: str, **changes: str | None) -> httpx.Response:
        fields: dict[str, str | None] = {"grant_type": "refresh_token", "refresh_token": secret}
        return self.post("token", **(fields | changes))

    def connect(self, who: Somebody, **changes: str | None) -> dict[str, Any]:
        """Return the first tokens that the app gets from a person."""
        answer = self.redeem(self.approve(who, **changes)["code"])
        assert answer.status_code == 200, answer.text
        tokens: dict[str, Any] = answer.json()
        return tokens


def fields_of(address: str) -> dict[str, str]:
    """Return the fields of an address's query."""
    return dict(parse_qsl(urlsplit(address).query))


def register(server: Server, who: Somebody, **changes: object) -> AppOf:
    """Register an app; a confidential one unless `changes` says otherwise."""
    facts: dict[str, object] = {
        "name": "Log",
        "home_page": "https://log.example/",
        "redirects": [REDIRECT],
        "confidential": True,
    }
    made = server.ask("POST", "/me/apps", who, facts | changes)
    assert made.status_code == 201, made.text
    return AppOf(server, made.json()["id"], made.json()["secret"])


def bearer(tokens: dict[str, Any]) -> Somebody:
    """Return the program that has these tokens."""
    return Somebody(headers={"authorization": f"Bearer {tokens['access_token']}"})
