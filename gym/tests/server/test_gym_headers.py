"""Headers of every answer, and the answers to failures."""

from __future__ import annotations

import pytest
from gym.tests.worlds import Server, World, hold, make_world
from sqlalchemy import update

from walltopo_gym.gyms.models import Gym
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.server.app import PREFIX

ALWAYS = {
    "x-content-type-options": "nosniff",
    "content-security-policy": "default-src 'none'; frame-ancestors 'none'",
    "referrer-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}


@pytest.mark.parametrize("path", ["/gyms", "/me", "/nothing", "/gyms/none/walls"])
def test_no_answer_is_run_framed_or_guessed(server: Server, path: str) -> None:
    answer = server.ask("GET", path)
    assert {name: answer.headers[name] for name in ALWAYS} == ALWAYS
    assert answer.headers["cache-control"] == "private, no-cache"
    assert "server" not in answer.headers


def test_a_page_that_came_out_of_photos_runs_nothing(world: World) -> None:
    assert world.publish(world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)]), {"number": 1}).is_success
    file = world.published()["files"]["index.html"].removeprefix(PREFIX)
    answer = world.server.ask("GET", file, world.people["member"])
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.headers["content-security-policy"].startswith("default-src 'none'")
    assert answer.headers["cache-control"].startswith("private")  # the gym is
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_a_defect_tells_nothing_of_the_program(world: World) -> None:
    world.server.services.store.put("content/abcd", b"<!doctype html>")
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    gyms = update(Gym).where(Gym.id == world.gym.id)
    with world.server.database.writing() as session:
        session.execute(gyms.values(time_zone="Nowhere/None"))
    try:
        answer = world.publish(scan, {"number": 1})
    finally:  # others share the server
        with world.server.database.writing() as session:
            session.execute(gyms.values(time_zone="UTC"))
    assert answer.status_code == 500
    assert answer.json()["title"] == "internal error in walltopo gym"
    assert "Nowhere" not in answer.text
    assert answer.headers["x-request-id"]


def test_a_full_disk_refuses_photos_and_serves_pages(world: World) -> None:
    server, setter = world.server, world.people["setter"]
    scan = world.scan()
    photo = world.photo(scan, size=5)
    full = Incoming(server.settings.data / "incoming", keep_free_mb=10**9)
    tus = {"tus-resumable": "1.0.0"}
    with server.replacing(full):
        path = f"{world.path}/scans/{scan}/photos"
        announced_headers = tus | {"upload-length": "5", "upload-metadata": "filename YS5qcGc="}
        announced = server.ask("POST", path, setter, headers=announced_headers)
        bytes_type = {"content-type": "application/offset+octet-stream", "upload-offset": "0"}
        place = f"{world.path}/photos/{photo}"
        sent = server.ask("PATCH", place, setter, headers=tus | bytes_type, content=b"bytes")
        assert (announced.status_code, sent.status_code) == (507, 507)
        assert "disk" in sent.json()["title"]
        assert len(server.ask("GET", path, setter).json()) == 1
        assert server.ask("GET", world.path, setter).status_code == 200


def test_another_gym_is_not_there_in_private(server: Server) -> None:
    """It answers as one that was never opened."""
    hidden, stranger = make_world(server), server.person()
    answers = [server.ask("GET", f"/gyms/{slug}", stranger) for slug in (hidden.gym.slug, "never")]
    assert answers[0].status_code == answers[1].status_code == 404
    assert answers[0].content == answers[1].content
