"""The store is the same to its callers in a folder and in an S3 bucket."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest
from gym.tests.s3 import BUCKET, s3_server
from gym.tests.worlds import Server, World, hold, make_world

from walltopo.core import SettingsError
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.operating.doctor import examine
from walltopo_gym.server.app import PREFIX
from walltopo_gym.settings import load_settings
from walltopo_gym.storage.files import FileStore, open_store


@pytest.fixture(scope="module")
def s3() -> Iterator[dict[str, str]]:
    with s3_server() as environment:
        yield environment


@pytest.fixture
def objects(s3: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> str:
    """The URL of an S3 bucket."""
    for name, value in s3.items():
        monkeypatch.setenv(name, value)
    return f"s3://{BUCKET}"


@pytest.fixture(params=["folder", "s3"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> FileStore:
    url = request.getfixturevalue("objects") if request.param == "s3" else ""
    return open_store(load_settings({"data": tmp_path, "objects": url}, {}))


def test_files_come_back_as_they_were(store: FileStore, tmp_path: Path) -> None:
    large = tmp_path / "large"
    large.write_bytes(bytes(range(256)) * 30_000)  # several parts
    store.put("a/large", large)
    store.put("a/small", b"one")
    store.put("a/small", b"two")
    assert store.has("a/small")
    assert not store.has("a/none")
    assert store.read("a/small") == b"two"
    store.fetch("a/large", tmp_path / "deep" / "back")
    assert (tmp_path / "deep" / "back").read_bytes() == large.read_bytes()
    assert store.keys("a/") == ["a/large", "a/small"]
    sizes = {key: size for key, size, at in store.entries("a/") if now() - at < timedelta(hours=1)}
    assert sizes == {"a/large": 7_680_000, "a/small": 3}
    store.drop(["a/large", "a/small", "a/small"])
    assert store.keys("a/") == []
    with pytest.raises(NotFoundError):
        store.chunks("a/small")


def test_a_wall_is_served_from_a_bucket(objects: str, tmp_path: Path) -> None:
    server = Server(tmp_path, objects=objects)
    world: World = make_world(server)
    assert world.publish(world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)]), {"number": 1}).is_success
    file = world.published()["files"]["index.html"].removeprefix(PREFIX)
    assert server.ask("GET", file, world.people["member"]).content == b"<!doctype html>"
    assert {f.state for f in examine(server.settings) if f.what == "files"} == {"well"}
    assert not (tmp_path / "files").exists()
    server.close()


def test_an_invalid_store_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="objects"):
        open_store(load_settings({"data": tmp_path, "objects": "walls"}, {}))
