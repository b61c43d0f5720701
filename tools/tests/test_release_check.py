"""The checks of a release find what they are there for."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from benchmarks.platforms import MACOS, WINDOWS
from packaging.requirements import Requirement
from tools.release_check import check_signature, run
from tools.upgrade_check import Walltopo, check_gym


def test_a_signature_holds_for_its_checksums_alone(tmp_path: Path) -> None:
    sums = tmp_path / "dist" / "SHA256SUMS"
    sums.parent.mkdir()
    sums.write_text("00ff  walltopo.whl\n")
    room = tmp_path / "room"
    room.mkdir()
    check_signature(sums, room)
    assert sums.read_text() == "00ff  walltopo.whl\n"


def test_a_command_that_fails_ends_the_check(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="exit code 3"):
        run(["bash", "-c", "exit 3"], tmp_path)


class Forgetful(Walltopo):
    """A version whose migration loses a row or a file."""

    def __init__(self, data: Path, loses: str) -> None:
        self.data, self.loses = data, loses

    def run(self, *arguments: str | Path, accepted: tuple[int, ...] = (0,)) -> str:
        if self.loses == "row":
            with sqlite3.connect(self.data / "gym.sqlite") as connection:
                connection.execute("DELETE FROM route")
        else:
            (self.data / "files" / "ab").unlink()
        return ""


@pytest.mark.parametrize(("loses", "message"), [("row", "rows of route"), ("file", "files ab")])
def test_an_upgrade_that_loses_something_is_found(loses: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "ab").write_bytes(b"photo")
    with sqlite3.connect(tmp_path / "gym.sqlite") as connection:
        connection.execute("CREATE TABLE route (id)")
        connection.execute("INSERT INTO route VALUES (1)")
    with pytest.raises(SystemExit, match=message):
        check_gym(Forgetful(tmp_path, loses), tmp_path)


def test_requirements_of_one_system() -> None:
    extra = Requirement("pywin32>=226 ; sys_platform == 'win32' and extra == 'win32'")
    assert WINDOWS.takes(extra, ["win32"], "3.12")
    assert not WINDOWS.takes(extra, [], "3.12")
    assert not MACOS.takes(extra, ["win32"], "3.12")
