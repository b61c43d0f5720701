"""Other sites embed a public wall by its address."""

from __future__ import annotations

import re
from html import unescape
from typing import Any
from urllib.parse import urlencode

import httpx
import pytest
from gym.tests.server.test_gym_pages import page
from gym.tests.worlds import ORIGIN, Server, World, hold, make_world

from walltopo_gym.scans.pictures import WIDTH


@pytest.fixture
def public(server: Server) -> World:
    world = make_world(server, visibility="public")
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    facts = {"number": 1, "name": '"><script>alert(1)</script>', "grade": ""}
    assert world.publish(scan, facts).is_success
    return world


def oembed(world: World, address: str, **query: Any) -> httpx.Response:
    return world.server.client().get("/oembed?" + urlencode({"url": address} | query))


def address_of(world: World) -> str:
    return f"{ORIGIN}/g/{world.gym.slug}/w/{world.wall.id}"


def test_a_wall_is_embedded_by_its_address(public: World) -> None:
    answer = oembed(public, address_of(public))
    body = answer.json()
    assert (body["version"], body["type"], body["title"]) == ("1.0", "rich", "Cave")
    frame = f'<iframe src="{ORIGIN}/embed/g/{public.gym.slug}/w/{public.wall.id}"'
    assert body["html"].startswith(frame)
    assert answer.headers["access-control-allow-origin"] == "*"
    assert body["thumbnail_width"] == WIDTH
    small = oembed(public, address_of(public), maxwidth=320, maxheight=200).json()
    assert (small["width"], small["height"]) == (320, 200)
    assert "thumbnail_url" not in small
    large = oembed(public, address_of(public), maxwidth=2000, maxheight=2000).json()
    assert large["thumbnail_width"] == WIDTH


@pytest.mark.parametrize("odd", ["//[", "/g/a%00/w/b", "/g/a%00b", "/g/%ff/w/x"])
def test_odd_addresses_are_not_found(public: World, odd: str) -> None:
    assert oembed(public, ORIGIN + odd).status_code == 404
    assert public.server.client().get(f"/api/v1/gyms/{odd[3:] or 'x'}").status_code == 404


def test_a_screen_of_an_odd_address_is_not_found(server: Server) -> None:
    answer = server.client().post("/api/v1/gyms/a%00b/screen/open", json={"secret": "x" * 43})
    assert answer.status_code == 404


def test_a_routes_name_cannot_leave_the_frame(public: World) -> None:
    route = public.published()["routes"][0]["id"]
    body = oembed(public, f"{address_of(public)}/r/{route}").json()
    assert body["title"].startswith('"><script>')
    assert "<script>" not in body["html"]
    assert f"/r/{route}" in body["html"]


def test_a_page_says_how_it_is_embedded(public: World) -> None:
    path = address_of(public).removeprefix(ORIGIN)
    text = page(public.server, path).text
    found = re.search(r'type="application/json[+]oembed" href="([^"]+)"', text)
    assert found is not None
    answer = public.server.client().get(unescape(found[1]).removeprefix(ORIGIN))
    assert answer.json()["title"] == "Cave"
    assert "oembed" not in page(public.server, f"/g/{public.gym.slug}").text


def test_what_is_not_public_is_not_found(public: World, world: World) -> None:
    assert world.publish(world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)]), {"number": 1}).is_success
    for address in (
        address_of(world),
        address_of(make_world(public.server, visibility="public")),  # nothing is published
        address_of(public).replace(ORIGIN, "https://evil.example"),
        address_of(public).replace(ORIGIN, ORIGIN + "@evil.example"),
        f"{ORIGIN}/g/{public.gym.slug}",
        f"{ORIGIN}/me",
        "",
    ):
        assert oembed(public, address).status_code == 404
    assert oembed(public, address_of(public), format="xml").status_code == 501
    assert oembed(public, address_of(public), maxwidth=1).status_code == 422
