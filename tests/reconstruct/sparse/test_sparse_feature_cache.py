"""The feature database: kept from run to run, dropped where it is damaged."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from walltopo.core import Silent
from walltopo.core.files import hash_path
from walltopo.pipeline.runner import run_stage
from walltopo.pipeline.settings import load_settings
from walltopo.scans.folder import ScanFolder

SETTINGS = load_settings(None, ["sparse.threads=1"])


class Steps(Silent):
    """A listener that records the totals of steps, and the notes."""

    def __init__(self) -> None:
        self.totals: dict[str, int | None] = {}
        self.notes: list[str] = []

    def step(self, what: str, total: int | None = None) -> None:
        self.totals[what] = total

    def note(self, message: str) -> None:
        self.notes.append(message)


def sparse(folder: ScanFolder) -> Steps:
    steps = Steps()
    run_stage(folder, "sparse", SETTINGS.sparse, steps)
    return steps


@pytest.fixture(scope="module")
def wall(tiny_scan: Path, tmp_path_factory: pytest.TempPathFactory) -> ScanFolder:
    return ScanFolder(shutil.copytree(tiny_scan, tmp_path_factory.mktemp("features") / "scan"))


def halved(data: bytes) -> bytes:
    return data[: len(data) // 2]


def one_bit(data: bytes) -> bytes:
    """In a descriptor, where SQLite notices nothing."""
    where = 2 * len(data) // 3
    return data[:where] + bytes([data[where] ^ 1]) + data[where + 1 :]


def noise(data: bytes) -> bytes:
    return bytes(range(256)) * 64


@pytest.mark.parametrize(
    ("damage", "complete"),
    # Without the content's hash, as a kill leaves it, only what breaks the file is seen.
    [
        (halved, True),
        (one_bit, True),
        pytest.param(noise, True, marks=pytest.mark.slow),
        pytest.param(halved, False, marks=pytest.mark.slow),
        (noise, False),
    ],
)
def test_damage_is_found_and_mended(
    wall: ScanFolder, damage: Callable[[bytes], bytes], complete: bool
) -> None:
    model = hash_path(wall.sparse_raw)
    database = wall.work / "features" / "features.db"
    stamp = database.parent / "made-from.json"
    if not complete:
        output = json.loads(stamp.read_text())
        del output["content"]
        stamp.write_text(json.dumps(output))
    database.write_bytes(damage(database.read_bytes()))
    steps = sparse(wall)
    assert steps.totals["find features"], "all are found again"
    assert any("features.db is damaged" in note for note in steps.notes)
    assert hash_path(wall.sparse_raw) == model


def test_what_is_whole_is_kept(wall: ScanFolder) -> None:
    steps = sparse(wall)
    assert "find features" not in steps.totals
    assert steps.notes == []
