"""Floor plans are decoded one at a time, however many are sent."""

from __future__ import annotations

import io
import threading
from typing import Any

import pytest
from gym.tests.worlds import World
from PIL import Image, ImageOps
from tests.at_once import at_once

from walltopo_gym.storage import pictures


def picture(size: tuple[int, int]) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", size, (200, 10, 10)).save(out, "PNG")
    return out.getvalue()


class CountedLock:
    """A lock that counts who wants it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.wanted = threading.Semaphore(0)

    def acquire(self, timeout: float) -> bool:
        self.wanted.release()
        return self._lock.acquire(timeout=timeout)

    def release(self) -> None:
        self._lock.release()


def test_floor_plans_are_decoded_one_at_a_time(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_now, most, lock = [0], [0], CountedLock()
    turn = ImageOps.exif_transpose
    all_came = threading.Event()

    def watched(image: Any) -> Any:
        open_now[0] += 1
        most[0] = max(most[0], open_now[0])
        if not all_came.is_set():  # the first picture stays open until all others wait
            for _ in range(6):
                assert lock.wanted.acquire(timeout=600)
            all_came.set()
        open_now[0] -= 1
        return turn(image)

    monkeypatch.setattr(ImageOps, "exif_transpose", watched)
    monkeypatch.setattr(pictures, "DECODING", lock)
    monkeypatch.setattr(pictures, "_PATIENCE_S", 600)
    path = f"{world.path}/floor-plan/picture"

    def put() -> int:
        answer = world.server.ask("PUT", path, world.owner, content=picture((90, 60)))
        return answer.status_code

    statuses = at_once(*6 * [put])
    assert set(statuses) <= {200, 409}  # two that write at the same moment
    assert most == [1]


def test_waiting_too_long_for_a_floor_plan_is_an_error(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pictures, "_PATIENCE_S", 0.05)
    path = f"{world.path}/floor-plan/picture"
    with pictures.DECODING:
        answer = world.server.ask("PUT", path, world.owner, content=picture((90, 60)))
    assert answer.status_code == 429
    bad = world.server.ask("PUT", path, world.owner, content=b"no picture")
    assert bad.status_code == 422
    assert world.server.ask("PUT", path, world.owner, content=picture((90, 60))).is_success
