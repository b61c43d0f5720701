"""A feature that is off has no endpoints, no pages' names, no jobs."""

from __future__ import annotations

import re
from datetime import timedelta
from pathlib import Path
from uuid import UUID, uuid4

import pytest
from fastapi.routing import APIRoute
from gym.tests.worlds import NOBODY, Server, World, hold, make_world

from walltopo_gym.clock import now
from walltopo_gym.competitions.models import Competition
from walltopo_gym.features import FEATURES as LISTED
from walltopo_gym.publishing.codes import code_of
from walltopo_gym.scans.stages import ScanSteps
from walltopo_gym.settings import GymSettings
from walltopo_gym.work import chores_of, tasks_of

FEATURES = ("clips", "competitions", "films", "hall", "insights", "inspections")
# An endpoint of each; films are a part of clips.
ENDPOINTS = {
    "clips": "/gyms/{gym}/clips",
    "competitions": "/gyms/{gym}/competitions",
    "hall": "/gyms/{gym}/hall",
    "insights": "/gyms/{gym}/insights",
    "inspections": "/gyms/{gym}/inspections",
}


def without(feature: str, folder: Path) -> World:
    on = tuple(name for name in FEATURES if name != feature)
    return make_world(Server(folder, features=on))


@pytest.mark.parametrize("feature", FEATURES)
def test_what_is_off_is_not_there(feature: str, tmp_path: Path) -> None:
    world = without(feature, tmp_path)
    server = world.server
    paths = server.app.openapi()["paths"]
    for name, path in ENDPOINTS.items():
        inner = path.format(gym=world.gym.slug)
        status = server.ask("GET", inner, world.people["setter"]).status_code
        assert (status == 404) == (name == feature), name
        assert any(found.endswith(path) for found in paths) == (name != feature)
    named = " ".join(name for name in FEATURES if name != feature)
    assert f'<meta name="features" content="{named}">' in server.client().get("/").text
    steps = ScanSteps(server.settings, server.database, server.services.store, tmp_path)
    jobs = {task.job.name for task in tasks_of(steps)}
    chores = {chore.name for chore in chores_of(steps)}
    assert {"mails", "pushes", "webhooks"} <= jobs
    assert "note-messages" in chores
    assert ("clips" in jobs) == ("tidy-clips" in chores) == (feature != "clips")
    assert ("competitions-begin" in chores) == (feature != "competitions")
    assert ("inspections-due" in chores) == (feature != "inspections")
    server.close()


def test_a_screen_opens_no_private_gym_without_the_hall(tmp_path: Path) -> None:
    world = without("hall", tmp_path)
    kiosk = {"cookie": "__Host-walltopo-kiosk=anything"}
    assert world.server.ask("GET", world.path, headers=kiosk).status_code == 404
    assert world.server.client().get("/r/abc").status_code == 404
    world.server.close()


def test_all_are_on_unless_the_settings_say_otherwise() -> None:
    assert GymSettings.model_fields["features"].default == FEATURES


ROUTERS = {feature.switch: feature.routers() for feature in LISTED if feature.switch is not None}
# All that a gym has of an optional feature: method and path.
BELOW = [
    (feature, method, route.path)
    for feature, routers in ROUTERS.items()
    for router in routers
    for route in router.routes
    if isinstance(route, APIRoute) and route.path.startswith("/gyms/{gym}/")
    for method in sorted(route.methods or ())
]


def turn_off(world: World, *features: str) -> None:
    answer = world.server.ask("PATCH", world.path, world.owner, {"features_off": list(features)})
    assert answer.status_code == 200, answer.text
    assert answer.json()["features_off"] == sorted(features)


@pytest.mark.parametrize(("feature", "method", "path"), BELOW)
def test_of_what_a_gym_has_off_no_endpoint_is_there(
    world: World, feature: str, method: str, path: str
) -> None:
    there = path.replace("{gym}", world.gym.slug).replace("{part}", "routes")
    there = re.sub(r"{\w+}", str(uuid4()), there)

    def code(who: str) -> object:
        answer = world.server.ask(method, there, world.people[who], {"secret": "s" * 20})
        has_code = answer.status_code == 404 and method != "HEAD"
        return answer.json().get("code") if has_code else answer.status_code

    def hidden(why: str) -> object:
        return 404 if method == "HEAD" else "screen-link-unknown" if is_link else why

    is_link = path.endswith("/screen/open")  # reveals nothing of the gym
    before = code("owner")
    assert before != "not-there-feature"
    turn_off(world, feature)
    assert code("owner") == hidden("not-there-feature")
    # Strangers do not learn which features a private gym has.
    assert code("stranger") == hidden("not-there-gym")
    turn_off(world)
    assert code("owner") == before


def test_only_the_owner_turns_a_feature_off(world: World) -> None:
    for who, status in (("setter", 403), ("stranger", 404), ("owner", 200)):
        answer = world.server.ask(
            "PATCH", world.path, world.people[who], {"features_off": ["hall", "hall"]}
        )
        assert answer.status_code == status, who
    unknown = {"features_off": ["walls"]}
    assert world.server.ask("PATCH", world.path, world.owner, unknown).status_code == 422
    assert world.server.ask("GET", world.path, world.people["member"]).json()["features_off"] == [
        "hall"
    ]


def test_screens_calendars_and_messages_do_without_a_gyms_competitions(world: World) -> None:
    with world.server.database.writing() as session:
        session.add(
            Competition(
                gym_id=world.gym.id,
                name="Cup of all",
                format="festival",
                about="",
                fee="",
                waiver="",
                starts_at=now() + timedelta(days=1),
                ends_at=None,
                self_entry=True,
                self_scoring=True,
                revision=0,
                last_seq=0,
                state="running",
            )
        )

    def answers_of() -> list[bool]:
        paths = (f"{world.path}/screen", f"{world.path}/calendar.ics")
        texts = [world.server.ask("GET", path, world.people["member"]).text for path in paths]
        return ["Cup of all" in text for text in texts]

    assert answers_of() == [True, True]
    turn_off(world, "competitions")
    assert answers_of() == [False, False]
    turn_off(world)
    assert answers_of() == [True, True]


def test_a_screens_link_and_short_addresses_end_with_the_hall(world: World) -> None:
    made = world.server.ask("POST", f"{world.path}/hall/key", world.owner)
    secret = made.json()["link"].partition("#")[2]
    kiosk = {"cookie": f"__Host-walltopo-kiosk={secret}"}

    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1}).is_success
    short = code_of(UUID(world.published()["routes"][0]["id"]))

    def seen() -> tuple[int, int]:
        on_screen = world.server.ask("GET", world.path, NOBODY, headers=kiosk)
        by_code = world.server.ask("GET", f"/short/{short}", world.people["member"])
        return on_screen.status_code, by_code.status_code

    assert seen() == (200, 200)
    turn_off(world, "hall")
    assert seen() == (404, 404)
    opened = world.server.ask("POST", f"{world.path}/screen/open", NOBODY, {"secret": secret})
    assert opened.status_code == 404
    turn_off(world)
    assert seen() == (200, 200)
