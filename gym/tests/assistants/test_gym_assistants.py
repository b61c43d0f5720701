"""The MCP server: as an assistant uses it, with the token of an app."""

from __future__ import annotations

import json
from typing import Any
from uuid import uuid4

import httpx
import pytest
from gym.tests.apps.consent import bearer, register
from gym.tests.worlds import NOBODY, ORIGIN, Somebody, World, hold

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.clock import now

INITIALIZE = {
    "protocolVersion": "2025-06-18",
    "capabilities": {},
    "clientInfo": {"name": "test", "version": "1"},
}


@pytest.fixture
def climbed(world: World) -> World:
    """A private gym with a route that the member has climbed."""
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1, "name": "Moon", "setter": "Jana"}).is_success
    route = world.published()["routes"][0]["id"]
    body = {"route_id": route, "kind": "flash", "climbed_at": now().isoformat()}
    path = f"{world.path}/ascents/{uuid4()}"
    assert world.server.ask("PUT", path, world.people["member"], body).is_success
    return world


def post(world: World, who: Somebody, body: object, **headers: str) -> httpx.Response:
    accept = {"accept": "application/json, text/event-stream"}
    content = body if isinstance(body, bytes) else json.dumps(body).encode()
    kind = {"content-type": "application/json"}
    sent = {**who.headers, **accept, **kind, **headers}
    return world.server.client().post("/mcp", content=content, headers=sent)


def ask(world: World, who: Somebody, method: str, **params: Any) -> dict[str, Any]:
    answer = post(world, who, {"jsonrpc": "2.0", "id": 1, "method": method, "params": params})
    assert answer.status_code == 200, answer.text
    body: dict[str, Any] = answer.json()
    assert (body["jsonrpc"], body["id"]) == ("2.0", 1)
    return body


def call(world: World, who: Somebody, tool: str, **arguments: Any) -> dict[str, Any]:
    """Return the result of a tool."""
    result: dict[str, Any] = ask(world, who, "tools/call", name=tool, arguments=arguments)["result"]
    assert (
        result["isError"]
        or json.loads(result["content"][0]["text"]) == (result["structuredContent"])
    )
    return result


def member_of(world: World) -> Somebody:
    return world.server.token(world.people["member"], Scope.READ)


def test_an_assistant_finds_a_route_and_reads_the_logbook(climbed: World) -> None:
    app = register(climbed.server, climbed.people["stranger"])
    resource = f"{ORIGIN}/mcp"
    who = bearer(app.connect(climbed.people["member"], resource=resource))
    begun = ask(climbed, who, "initialize", **INITIALIZE)["result"]
    assert begun["protocolVersion"] == "2025-06-18"
    note = {"jsonrpc": "2.0", "method": "notifications/initialized"}
    assert post(climbed, who, note).status_code == 202
    assert ask(climbed, who, "ping")["result"] == {}
    tools = ask(climbed, who, "tools/list")["result"]["tools"]
    assert all(tool["annotations"]["readOnlyHint"] for tool in tools)
    assert all(tool["inputSchema"]["type"] == "object" for tool in tools)
    gyms = call(climbed, who, "find_gyms", words=climbed.gym.name)["structuredContent"]["gyms"]
    gym = gyms[0]["slug"]
    (wall,) = call(climbed, who, "list_walls", gym=gym)["structuredContent"]["walls"]
    found = call(climbed, who, "list_routes", gym=gym, wall=wall["id"])["structuredContent"]
    (route,) = found["routes"]
    assert (route["name"], route["setter"], found["left_out"]) == ("Moon", "Jana", 0)
    assert call(climbed, who, "list_routes", gym=gym)["structuredContent"] == found
    whole = call(climbed, who, "read_route", gym=gym, route=route["id"])["structuredContent"]
    assert (whole["climbers"], whole["is_current"]) == (1, True)
    (entry,) = call(climbed, who, "read_logbook")["structuredContent"]["entries"]
    assert (entry["name"], entry["kind"]) == ("Moon", "flash")


def test_a_logbook_is_the_persons_own(climbed: World) -> None:
    who = climbed.server.token(climbed.people["judge"], Scope.READ)
    assert call(climbed, who, "read_logbook")["structuredContent"]["entries"] == []


def test_a_private_gym_is_not_there_for_strangers(climbed: World) -> None:
    who = climbed.server.token(climbed.people["stranger"], Scope.READ)
    gyms = call(climbed, who, "find_gyms", words=climbed.gym.name)["structuredContent"]["gyms"]
    assert climbed.gym.slug not in [gym["slug"] for gym in gyms]
    result = call(climbed, who, "list_routes", gym=climbed.gym.slug)
    assert result["isError"]
    assert "no such gym" in result["content"][0]["text"]


def test_nobody_is_let_in_without_a_token(climbed: World) -> None:
    wrong = Somebody(headers={"authorization": "Bearer wtg_wrong"})
    message = {"jsonrpc": "2.0", "id": 1, "method": "tools/list"}
    for who in (NOBODY, climbed.people["member"], wrong):  # a cookie is no token
        answer = post(climbed, who, message)
        assert answer.status_code == 401
        described = f'resource_metadata="{ORIGIN}/.well-known/oauth-protected-resource/mcp"'
        assert described in answer.headers["www-authenticate"]
        is_shared = "cookie" not in who.headers
        assert ("access-control-allow-origin" in answer.headers) == is_shared


def test_a_token_needs_the_scope(climbed: World) -> None:
    who = climbed.server.token(climbed.people["member"], Scope.UPLOAD)
    result = call(climbed, who, "read_logbook")
    assert result["isError"]
    assert "scope 'read'" in result["content"][0]["text"]


def test_odd_messages_get_the_errors_of_json_rpc(climbed: World) -> None:
    who = member_of(climbed)
    for content, code in (
        (b"{", -32700),
        (b"[" * 5000, -32700),
        (b"[]", -32600),
        (b'{"id": 1, "method": "ping"}', -32600),
        (b'{"jsonrpc": "2.0", "id": null, "method": "ping"}', -32600),
        (b'{"jsonrpc": "2.0", "id": 1, "method": 7}', -32600),
        (b'{"jsonrpc": "2.0", "id": 1, "method": "ping", "params": []}', -32602),
        (b'{"jsonrpc": "2.0", "id": 1, "method": "resources/list"}', -32601),
    ):
        assert post(climbed, who, content).json()["error"]["code"] == code, content
    for params in (
        {"name": "drop_everything"},
        {"name": "list_walls"},
        {"name": "list_walls", "arguments": {"gym": "x", "more": 1}},
        {"name": "read_logbook", "arguments": {"most": 10_000}},
        {"name": "read_route", "arguments": {"gym": "x", "route": "y"}},
        {"name": "list_walls", "arguments": "gym"},
    ):
        assert ask(climbed, who, "tools/call", **params)["error"]["code"] == -32602, params


def test_there_is_neither_a_stream_nor_an_unknown_version(climbed: World) -> None:
    client, who = climbed.server.client(), member_of(climbed)
    for method in ("GET", "DELETE"):
        assert client.request(method, "/mcp", headers=who.headers).status_code == 405
    ping = {"jsonrpc": "2.0", "id": 1, "method": "ping"}
    odd = {"mcp-protocol-version": "1999-01-01"}
    assert post(climbed, who, ping, **odd).status_code == 400
    old = ask(climbed, who, "initialize", **INITIALIZE | {"protocolVersion": "2024-01-01"})
    assert old["result"]["protocolVersion"] == "2025-06-18"
