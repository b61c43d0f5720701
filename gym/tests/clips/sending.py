"""Send, read and confirm clips as a phone does."""

from __future__ import annotations

import hashlib
from base64 import b64encode
from typing import Any
from uuid import UUID

from gym.tests.worlds import World
from sqlalchemy import update

from walltopo_gym.api.tus import CONTENT_TYPE
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.reading import ClipReadings

VIDEO = b"no video, but bytes" * 9
TUS = {"tus-resumable": "1.0.0"}


def announce(
    world: World, who: str, route: str, name: str = "a.mp4", size: int = 0, *, film: bool = False
) -> Any:
    words = {"filename": name, "sha256": hashlib.sha256(VIDEO).hexdigest()}
    metadata = ",".join(f"{key} {b64encode(word.encode()).decode()}" for key, word in words.items())
    headers = TUS | {"upload-length": str(size or len(VIDEO)), "upload-metadata": metadata}
    path = f"{world.path}/routes/{route}/clips{'?film=true' if film else ''}"
    return world.server.ask("POST", path, world.people[who], headers=headers)


def send(world: World, who: str, clip: str, offset: int, content: bytes) -> Any:
    headers = TUS | {"upload-offset": str(offset), "content-type": CONTENT_TYPE}
    path = f"{world.path}/clips/{clip}"
    return world.server.ask("PATCH", path, world.people[who], headers=headers, content=content)


def sent(world: World, who: str, route: str, content: bytes = VIDEO, *, film: bool = False) -> str:
    answer = announce(world, who, route, film=film)
    assert answer.status_code == 201, answer.text
    clip = str(answer.headers["location"]).rpartition("/")[2]
    assert send(world, who, clip, 0, content).status_code == 204
    return clip


def read(world: World, who: str, route: str, attempt: Any) -> str:
    """Return a clip as it is after its reading."""
    clip = sent(world, who, route)
    with world.server.database.writing() as session:
        session.execute(
            update(Clip)
            .where(Clip.id == UUID(clip))
            .values(state="read", attempt=attempt, holds=[1, 2, 3])
        )
    return clip


def clips(world: World, who: str, route: str) -> Any:
    path = f"{world.path}/clips?route={route}"
    answer = world.server.ask("GET", path, world.people[who])
    assert answer.status_code == 200, answer.text
    return answer.json()["clips"]


def confirm(world: World, who: str, clip: str, *moves: tuple[int, int]) -> Any:
    body = {"moves": [{"number": number, "hold": hold} for number, hold in moves]}
    return world.server.ask("PUT", f"{world.path}/clips/{clip}/confirmed", world.people[who], body)


def readings(world: World) -> ClipReadings:
    server = world.server
    return ClipReadings(server.settings, server.database, server.services.store)
