"""Storage quotas and features of gyms, as an operator sets them."""

from __future__ import annotations

from typing import Any

import httpx
import pytest
from gym.tests.operating.test_gym_operator_page import command, logged
from gym.tests.running import TUS
from gym.tests.worlds import Server, Somebody, World, make_world

from walltopo.core import InputError
from walltopo_gym.operating.storage_use import measure_storage


@pytest.fixture
def operator(server: Server) -> Somebody:
    return server.person("operator")


def limit(world: World, operator: Somebody, quota: int | None, *barred: str) -> dict[str, Any]:
    body = {"quota_mb": quota, "features_barred": list(barred)}
    path = f"/operator/gyms/{world.gym.id}/limits"
    answer = world.server.ask("PUT", path, operator, body)
    assert answer.is_success, answer.text
    found: dict[str, Any] = answer.json()
    return found


def announce(world: World, size: int) -> httpx.Response:
    headers = {**TUS, "upload-length": str(size), "upload-metadata": "filename YS5qcGc="}
    path = f"{world.path}/scans/{world.scan()}/photos"
    return world.server.ask("POST", path, world.people["setter"], headers=headers)


def used(world: World) -> dict[str, Any]:
    answer = world.server.ask("GET", f"{world.path}/storage", world.owner)
    found: dict[str, Any] = answer.json()
    return found


def test_an_upload_above_the_quota_is_refused(world: World, operator: Somebody) -> None:
    assert used(world) == {"used": 0, "quota_mb": None}
    assert limit(world, operator, 1)["quota_mb"] == 1
    assert announce(world, 600_000).status_code == 201
    refused = announce(world, 600_000)
    assert (refused.status_code, refused.json()["code"]) == (413, "storage-full")
    assert "1 MB" in refused.json()["title"]
    assert used(world) == {"used": 600_000, "quota_mb": 1}
    assert announce(world, 400_000).status_code == 201
    assert limit(world, operator, None)["quota_mb"] is None
    assert announce(world, 600_000).status_code == 201
    assert logged(world.server, operator) == [("gym.limit", world.gym.slug)] * 2


def test_the_quota_counts_what_was_measured_and_photos_since(
    world: World, operator: Somebody
) -> None:
    server = world.server
    other = make_world(server)
    scan = world.scan()
    server.services.store.put(f"scans/{scan}/sparse.bin", b"0" * 300_000)
    assert announce(world, 500_000).status_code == 201
    measure_storage(server.database, server.services.store)
    assert used(world)["used"] == 300_000  # the photo has not arrived
    assert announce(world, 200_000).status_code == 201
    assert used(world)["used"] == 500_000
    assert used(other)["used"] == 0
    rows = server.ask("GET", "/operator/gyms?size=200", operator).json()["items"]
    found = {row["slug"]: row for row in rows}
    assert found[world.gym.slug]["used"] == 500_000
    assert found[world.gym.slug]["members"] == 4


def test_a_barred_feature_is_off_whatever_the_owner_chooses(
    world: World, operator: Somebody
) -> None:
    server, path = world.server, f"{world.path}/insights"
    assert server.ask("GET", path, world.owner).is_success
    assert limit(world, operator, None, "insights", "insights")["features_barred"] == ["insights"]
    refused = server.ask("GET", path, world.owner)
    assert (refused.status_code, refused.json()["code"]) == (404, "not-there-feature")
    owners = server.ask("PATCH", world.path, world.owner, {"features_off": []}).json()
    assert (owners["features_off"], owners["features_barred"]) == ([], ["insights"])
    assert server.ask("GET", path, world.owner).status_code == 404
    limit(world, operator, None)
    assert server.ask("GET", path, world.owner).is_success


def test_the_command_limits_a_gym(world: World, capsys: pytest.CaptureFixture[str]) -> None:
    slug = world.gym.slug
    assert command(world.server, "gym", "limit", slug, "--quota", "7", "--off", "hall") == 0
    line = next(
        each for each in capsys.readouterr().out.splitlines() if each.startswith(f"{slug} ")
    )
    assert line.endswith(", at most 7 MB, without hall")
    assert command(world.server, "gym", "limit", slug) == 0
    line = next(
        each for each in capsys.readouterr().out.splitlines() if each.startswith(f"{slug} ")
    )
    assert "MB" not in line
    assert command(world.server, "gym", "limit", slug, "--off", "walls") == InputError.exit_code
