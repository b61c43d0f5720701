"""The floor plan: pixels alone are kept, walls lie on it, and it goes with the gym."""

from __future__ import annotations

from io import BytesIO
from typing import Any
from uuid import uuid4

import pytest
from gym.tests.worlds import NOBODY, World
from PIL import Image

from walltopo_gym.operating import purge as purging
from walltopo_gym.storage.files import FileStore


def picture(width: int, height: int, kind: str = "JPEG", **more: Any) -> bytes:
    stream = BytesIO()
    Image.new("RGB", (width, height), "white").save(stream, kind, **more)
    return stream.getvalue()


def put(world: World, content: bytes) -> Any:
    return world.server.ask("PUT", f"{world.path}/floor-plan/picture", world.owner, content=content)


def test_a_picture_is_stored_upright_small_and_without_metadata(world: World) -> None:
    exif = Image.Exif()
    exif[0x0112], exif[0x013B] = 6, "Jana"  # turned by a quarter; by whom
    facts = put(world, picture(4000, 1000, exif=exif)).json()
    assert (facts["width"], facts["height"]) == (400, 1600)
    path = facts["picture"].removeprefix("/api/v1")
    answer = world.server.ask("GET", path, world.people["member"])
    assert (answer.headers["content-type"], b"Jana" in answer.content) == ("image/png", False)
    assert world.server.ask("GET", path, NOBODY).status_code == 404  # of a private gym
    assert world.server.ask("DELETE", f"{world.path}/floor-plan/picture", world.owner).is_success
    assert world.server.ask("GET", path, world.owner).status_code == 404


@pytest.mark.parametrize(
    "content", [b"", b"<svg onload='alert(1)'/>", picture(9000, 9000, "PNG"), picture(9, 9, "GIF")]
)
def test_what_is_no_picture_of_ours_is_refused(world: World, content: bytes) -> None:
    assert put(world, content).status_code == 422
    assert world.server.ask("GET", f"{world.path}/floor-plan", world.owner).json()["walls"] == []


def test_walls_lie_on_it_and_off_it(world: World) -> None:
    path = f"{world.path}/floor-plan"
    here = {"wall_id": str(world.wall.id), "x": 0.25, "y": 1.0}

    def place(*walls: dict[str, Any]) -> Any:
        return world.server.ask("PUT", path, world.owner, {"walls": list(walls)})

    assert place(here).json()["walls"] == [here]
    assert place(here, here).status_code == 422
    assert place(here | {"wall_id": str(uuid4())}).status_code == 404
    assert place(here | {"x": 1.1}).status_code == 422
    assert world.server.ask("GET", path, world.people["member"]).json()["walls"] == [here]
    assert place().json() == {"picture": None, "width": 1, "height": 1, "walls": []}


def test_a_picture_that_no_gym_has_any_more_may_go(world: World) -> None:
    store: FileStore = world.server.services.store
    put(world, picture(70, 40))
    put(world, picture(80, 40))
    kept = store.keys("plans/")
    named = [
        key for key in kept if purging._is_named(world.server.settings, world.server.database, key)
    ]
    assert len(named) >= 1
    assert len(kept) > len(named)
