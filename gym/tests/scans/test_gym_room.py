"""The disk keeps its free space, whatever is announced and sent at the same time."""

from __future__ import annotations

import os
from collections import namedtuple
from collections.abc import Iterator
from pathlib import Path
from uuid import UUID

import httpx
import pytest
from gym.tests.running import TUS, offset_of, send
from gym.tests.scans.test_gym_uploads import Sender
from gym.tests.worlds import World

from walltopo_gym.scans.incoming import Incoming

MB = 1_000_000
Usage = namedtuple("Usage", "total used free")


class Disk:
    """A disk of 20 MB on which the unfinished photos lie; 4 MB of it are to stay free."""

    def __init__(self, world: World, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = world.server.settings.data / "incoming"
        for path in self.folder.iterdir():
            path.unlink()
        self.others = 0
        self.incoming = Incoming(self.folder, keep_free_mb=4)
        monkeypatch.setattr("shutil.disk_usage", self.usage)

    def usage(self, _: Path) -> Usage:
        used = self.others + sum(path.stat().st_size for path in self.folder.iterdir())
        return Usage(20 * MB, used, 20 * MB - used)


@pytest.fixture
def disk(world: World, monkeypatch: pytest.MonkeyPatch) -> Iterator[Disk]:
    made = Disk(world, monkeypatch)
    with world.server.replacing(made.incoming):
        yield made


def announced(phone: Sender, size: int) -> httpx.Response:
    headers = TUS | {"upload-length": str(size), "upload-metadata": "filename YS5qcGc="}
    return phone.client.post(phone.path, headers=headers)


def test_what_is_announced_is_reserved(world: World, disk: Disk) -> None:
    """16 MB are free; a photo takes twice its size until it lies in the store alone."""
    phone = Sender(world)
    first = announced(phone, 4 * MB)
    assert first.status_code == 201
    assert announced(phone, 5 * MB).status_code == 507
    assert announced(phone, 4 * MB).status_code == 201
    assert announced(phone, 1).status_code == 507
    # Half of the first one came: it takes as much as before.
    place = first.headers["location"]
    assert send(phone.client, place, bytes(2 * MB)).status_code == 204
    assert announced(phone, 1).status_code == 507
    # An announced photo that never comes reserves no room for ever.
    late = disk.folder / UUID(place.rpartition("/")[2]).hex
    os.utime(late, (0, 0))
    assert announced(phone, 2 * MB).status_code == 201


def test_a_photo_stops_where_the_disk_becomes_full(world: World, disk: Disk) -> None:
    phone = Sender(world)
    place = announced(phone, 7 * MB).headers["location"]
    disk.others = 13 * MB  # something else was written meanwhile
    answer = send(phone.client, place, bytes(7 * MB))
    assert answer.status_code == 507
    assert "disk" in answer.json()["title"]
    assert disk.usage(disk.folder).free >= 4 * MB
    disk.others = 0
    there = offset_of(phone.client, place)
    assert there >= 2 * MB  # what had room is kept
    assert send(phone.client, place, bytes(7 * MB), there).status_code == 204


def test_a_nearly_full_disk_is_reported(world: World, disk: Disk) -> None:
    client = world.server.client()
    assert client.get("/ready").json() == {"status": "ok"}
    disk.others = 17 * MB
    nearly = client.get("/ready")
    assert (nearly.status_code, nearly.json()["status"]) == (200, "the disk is nearly full")
    disk.others = 20 * MB - 1
    full = client.get("/ready")
    assert (full.status_code, full.json()["title"]) == (503, "the disk is full")
