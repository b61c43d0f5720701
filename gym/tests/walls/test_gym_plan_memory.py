"""Floor plans are decoded one at a time, however many are sent."""

from __future__ import annotations

import io
import threading
import time
from typing import Any

import pytest
from gym.tests.worlds import World
from PIL import Image, ImageOps

from walltopo_gym.walls import service as floor_plans


def picture(size: tuple[int, int]) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", size, (200, 10, 10)).save(out, "PNG")
    return out.getvalue()


def test_floor_plans_are_decoded_one_at_a_time(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_now, most = [0], [0]
    turn = ImageOps.exif_transpose

    def watched(image: Any) -> Any:
        open_now[0] += 1
        most[0] = max(most[0], open_now[0])
        time.sleep(0.1)
        open_now[0] -= 1
        return turn(image)

    monkeypatch.setattr(ImageOps, "exif_transpose", watched)
    monkeypatch.setattr(floor_plans, "_PATIENCE_S", 30, raising=False)
    path, statuses = f"{world.path}/floor-plan/picture", []

    def put() -> None:
        answer = world.server.ask("PUT", path, world.owner, content=picture((90, 60)))
        statuses.append(answer.status_code)

    threads = [threading.Thread(target=put) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(statuses) <= {200, 409}  # two that write at the same moment
    assert most == [1]


def test_waiting_too_long_for_a_floor_plan_is_an_error(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(floor_plans, "_PATIENCE_S", 0.05)
    path = f"{world.path}/floor-plan/picture"
    with floor_plans.DECODING:
        answer = world.server.ask("PUT", path, world.owner, content=picture((90, 60)))
    assert answer.status_code == 429
    bad = world.server.ask("PUT", path, world.owner, content=b"no picture")
    assert bad.status_code == 422
    assert world.server.ask("PUT", path, world.owner, content=picture((90, 60))).is_success
