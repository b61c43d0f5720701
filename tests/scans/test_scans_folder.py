"""Atomic writes and content hashes."""

from __future__ import annotations

from pathlib import Path

import pytest

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.files import atomic_path, hash_path, read_json, write_json


def test_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "a.json"
    write_json(target, {"old": 1})
    with pytest.raises(ValueError, match="JSON"):
        write_json(target, {"bad": float("nan")})
    with pytest.raises(KeyboardInterrupt), atomic_path(target) as temporary:  # noqa: PT012
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert read_json(target) == {"old": 1}
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_folder_is_replaced_whole(tmp_path: Path) -> None:
    target = tmp_path / "folder"
    for name in ("first", "second"):
        with atomic_path(target) as temporary:
            temporary.mkdir()
            (temporary / name).write_text(name)
    assert [p.name for p in target.iterdir()] == ["second"]


def test_hash_sees_content_and_names(tmp_path: Path) -> None:
    folder = tmp_path / "f"
    folder.mkdir()
    (folder / "a").write_text("x")
    first = hash_path(folder)
    (folder / "a").rename(folder / "b")
    second = hash_path(folder)
    (folder / "b").write_text("y")
    assert len({first, second, hash_path(folder), hash_path(tmp_path / "none")}) == 4


def test_no_space_left_is_reported(tmp_path: Path) -> None:
    with pytest.raises(EnvironmentLacksError, match="space"), atomic_path(tmp_path / "a"):
        raise OSError(28, "No space left on device")


@pytest.mark.parametrize(("content", "message"), [(None, "no such"), ("{", "JSON")])
def test_unreadable_json_names_the_file(tmp_path: Path, content: str | None, message: str) -> None:
    path = tmp_path / "x.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=message) as caught:
        read_json(path)
    assert str(path) in str(caught.value)
