"""The scripts of examples/ run, on scans that other tests made."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from walltopo.scans.edits import EditLog
from walltopo.scans.holds import Holds
from walltopo.scans.routes import Routes

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name: str, *words: object) -> str:
    command = [sys.executable, EXAMPLES / f"{name}.py", *words]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture
def copied(tiny_scan: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(tiny_scan, tmp_path / tiny_scan.name))


@pytest.mark.slow
def test_correct_and_export(copied: Path) -> None:
    before = len(Holds.load(copied / "holds.json").holds)
    output = run("correct_and_export", copied)
    assert "edit, export" in output
    assert Routes.load(copied / "routes.json").routes[0].name == "The Owl"
    assert len(Holds.load(copied / "holds.json").holds) == before - 1
    assert len(EditLog.load(copied / "edits.json").edits) == 2


@pytest.mark.slow
def test_compare_resets(tiny_scan: Path) -> None:
    """A wall compared with itself: all stayed."""
    holds = len(Holds.load(tiny_scan / "holds.json").holds)
    routes = len(Routes.load(tiny_scan / "routes.json").routes)
    output = run("compare_resets", tiny_scan, tiny_scan)
    assert f"{holds} stayed" in output
    assert output.count("kept:") == routes


def test_gym_statistics(tiny_scan: Path) -> None:
    rows = run("gym_statistics", tiny_scan, tiny_scan).splitlines()
    routes = Routes.load(tiny_scan / "routes.json").routes
    assert rows[0].startswith("wall,route,colour")
    assert len(rows) == 1 + 2 * (len(routes) + 1)
    assert rows[1].split(",")[3] == str(len(routes[0].holds))


@pytest.mark.slow
def test_lift_own_data_of_a_scene_that_is_not_climbing(tmp_path: Path) -> None:
    """Twelve things and the table top; both layouts of cameras give the same."""
    run("table_scene", tmp_path)
    cameras = ("sparse", "transforms.json")
    output = {
        run("lift_own_data", tmp_path / "table.ply", tmp_path / name, tmp_path / "ids")
        for name in cameras
    }
    assert len(output) == 1
    loss, *things = output.pop().splitlines()
    assert loss == "each photo of the masks has a camera"
    assert len(things) == 12


def test_scan_photos(tiny_photos: Path, copied: Path) -> None:
    """On a scan that is up to date: what the others made is not made again."""
    output = run("scan_photos", tiny_photos, copied, "sparse.threads=1", "texture.size=512")
    assert "nothing, all was up to date" in output
    assert "route 1" in output
