"""Pages of other origins read the API as programs do, and never with a cookie."""

from __future__ import annotations

from uuid import uuid4

import pytest
from gym.tests.worlds import NOBODY, Server, World, hold, make_world

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.server.app import PREFIX

OTHER = {"origin": "https://blog.example", "sec-fetch-site": "cross-site"}
WANTED = {"access-control-request-method": "GET", "access-control-request-headers": "authorization"}


@pytest.fixture
def public(server: Server) -> World:
    """A public gym with a published wall."""
    world = make_world(server, visibility="public")
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1}).is_success
    return world


def test_any_page_reads_public_data(public: World) -> None:
    server, published = public.server, public.published()
    paths = [public.path, f"{public.path}/walls/{public.wall.id}/published"]
    paths += [file.removeprefix(PREFIX) for file in published["files"].values()]
    for path in paths:
        answer = server.ask("GET", path, headers=OTHER)
        assert answer.status_code == 200
        assert answer.headers["access-control-allow-origin"] == "*"
        assert "access-control-allow-credentials" not in answer.headers
    assert answer.headers["cross-origin-resource-policy"] == "cross-origin"  # a public file


def test_refusals_are_readable_too(server: Server) -> None:
    for path in ("/gyms/none", "/me"):
        answer = server.ask("GET", path, headers=OTHER)
        assert answer.status_code in (401, 404)
        assert answer.headers["access-control-allow-origin"] == "*"


def test_a_page_with_a_token_may_do_what_its_scope_allows(world: World) -> None:
    server, token = world.server, world.server.token(world.owner, Scope.MANAGE)
    body = {"url": f"https://example.com/{uuid4()}"}
    path = f"{world.path}/webhooks"
    assert server.ask("POST", path, token, body, headers=OTHER).status_code == 201
    ours = {"authorization": "Bearer wrong", **world.owner.headers}
    answer = server.ask("POST", path, json=body, headers=OTHER | ours)
    assert answer.json()["code"] == "token-unknown"  # the cookie counts for nothing
    basic = {"authorization": "Basic eDp5"}
    answer = server.ask("POST", path, world.owner, body, headers=OTHER | basic)
    assert answer.json()["code"] == "other-site"


def test_no_preflight_allows_cookies(server: Server) -> None:
    client = server.client()
    for path in (f"{PREFIX}/gyms", "/oauth/token", "/.well-known/oauth-authorization-server"):
        answer = client.options(path, headers=OTHER | WANTED)
        assert answer.status_code == 204
        assert answer.headers["access-control-allow-origin"] == "*"
        assert "authorization" in answer.headers["access-control-allow-headers"]
        assert "access-control-allow-credentials" not in answer.headers


def test_what_is_private_is_embedded_by_nobody(world: World) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1}).is_success
    file = world.published()["files"]["index.html"].removeprefix(PREFIX)
    answer = world.server.ask("GET", file, world.people["member"], headers=OTHER)
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"


def test_no_page_reads_a_kept_answer_to_somebody(world: World) -> None:
    """A browser keeps answers, and hands them to pages of the same site without asking again."""
    member, bearer = world.people["member"], world.server.token(world.owner, Scope.READ)
    for path in ("/me", world.path):
        for who, is_shared in ((member, False), (bearer, True), (NOBODY, True)):
            answer = world.server.ask("GET", path, who, headers=OTHER)
            assert ("access-control-allow-origin" in answer.headers) == is_shared
            assert "Cookie" in answer.headers["vary"]


def test_no_page_tries_passwords_in_visitors_browsers(world: World) -> None:
    headers = OTHER | {"sec-fetch-site": "cross-site"}
    body = {"email": world.owner.email, "password": "guessed"}
    bearer = world.server.token(world.people["member"], Scope.READ)
    for who in (NOBODY, bearer):
        assert world.server.ask("POST", "/session", who, body, headers).status_code == 403


def test_a_defect_is_readable_too(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("a defect")

    monkeypatch.setattr(server.database, "reading", fail)
    answer = server.ask("GET", "/gyms", headers=OTHER)
    assert answer.status_code == 500
    assert answer.headers["access-control-allow-origin"] == "*"


def test_no_page_of_the_app_is_shared(server: Server) -> None:
    for path in ("/", "/sign-in", "/oauth/authorize", "/health", "/metrics"):
        answer = server.client().get(path, headers=OTHER)
        assert "access-control-allow-origin" not in answer.headers
        preflight = server.client().options(path, headers=OTHER | WANTED)
        assert "access-control-allow-origin" not in preflight.headers
