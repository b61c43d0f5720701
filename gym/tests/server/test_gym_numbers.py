"""A number in a header, a path or a query is digits from 0 to 9, and nothing else that Python reads
as one."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.dependencies.utils import get_flat_params
from fastapi.routing import APIRoute
from gym.tests.running import TUS
from gym.tests.worlds import Server, World

from walltopo_gym.features import FEATURES
from walltopo_gym.publishing.route_table import _parse_day
from walltopo_gym.server.app import _CORE

NO_DIGITS = ("+5", "1_0", " 5", "5 ", "5.0", "-0", "0x5", "٥", "５", "", "5e0")


def integers() -> Iterator[tuple[str, Any]]:
    """Yield each parameter outside of bodies that is a whole number, and its endpoint's path."""
    slices = (*_CORE, *(feature.routers() for feature in FEATURES))
    for router in (router for routers in slices for router in routers):
        for route in router.routes:
            assert isinstance(route, APIRoute)
            for field in get_flat_params(route.dependant):
                if field.field_info.annotation is int:
                    yield route.path, field


def test_every_parameter_takes_digits_alone() -> None:
    found = list(integers())
    assert len(found) > 15
    assert {field.name for _, field in found} >= {"size", "upload_length", "upload_offset", "skip"}
    for path, field in found:
        _, refused = field.validate("5", {}, loc=())
        assert not refused, (path, field.name)
        taken = [text for text in NO_DIGITS if not field.validate(text, {}, loc=())[1]]
        assert taken == [], (path, field.name)


@pytest.mark.parametrize("number", NO_DIGITS, ids=ascii)
def test_an_upload_is_announced_and_sent_by_digits(world: World, number: str) -> None:
    server, setter = world.server, world.people["setter"]
    given: Any = number.encode()
    metadata: Any = {"upload-length": given, "upload-metadata": "filename YS5qcGc="}
    scan = world.scan()
    path = f"{world.path}/scans/{scan}/photos"
    assert server.ask("POST", path, setter, headers=TUS | metadata).status_code == 422
    photo = world.photo(scan, size=9)
    kind: Any = {"content-type": "application/offset+octet-stream", "upload-offset": given}
    path = f"{world.path}/photos/{photo}"
    assert server.ask("PATCH", path, setter, headers=TUS | kind, content=b"1").status_code == 422
    assert server.incoming.offset(photo) == 0


def test_a_cursor_has_one_spelling(server: Server) -> None:
    """`UUID` reads signs, lines, and other scripts' digits."""
    moment, key = "2026-03-01T12:00:00+00:00", "0" * 31 + "5"
    spelled = [
        f"{moment} {key}",
        f"2026-03-01T12:00:00Z {key}",
        f"{moment} +{key[1:]}",
        f"{moment} 0_{key[2:]}",
        f"{moment} {{{key}}}",
        f"{moment} {key[:-1]}٥",
        f"20260301T120000+00:00 {key}",
    ]
    statuses = []
    for text in spelled:
        cursor = base64.urlsafe_b64encode(text.encode()).decode()
        statuses.append(server.client().get(f"/api/v1/gyms?cursor={cursor}").status_code)
    junk = base64.urlsafe_b64encode(spelled[0].encode()).decode() + "!"
    statuses.append(server.client().get(f"/api/v1/gyms?cursor={junk}").status_code)
    assert statuses == [200, *[422] * len(spelled)]


def test_days_and_periods_are_written_in_digits(world: World) -> None:
    member = world.people["member"]
    for period, status in (("2026-03", 200), ("٢٠٢٦-03", 422), ("２０２６", 422)):
        path = f"{world.path}/board?period={period}"
        assert world.server.ask("GET", path, member).status_code == status
    for cell in ("٢٠٢٦-03-01", "1. ٣. 2026", "１/03/2026"):
        wrong: list[Any] = []
        assert _parse_day(cell, "set_on", "dmy", wrong) is None
        assert [one.error.key for one in wrong] == ["cell-no-day"]
