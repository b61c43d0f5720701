"""`walltopo moves` and `walltopo grade` on holds and routes of a scan."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest

from walltopo.cli import main
from walltopo.core import Silent
from walltopo.pipeline.plan import Step
from walltopo.pipeline.renewals import renew_inputs
from walltopo.pipeline.stages.export import EXPORT
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.manifest import Manifest
from walltopo.scans.moves import Moves
from walltopo.scans.routes import Route, Routes


@pytest.fixture
def wall(tmp_path: Path) -> Path:
    """A ladder of eight jugs as route 1, graded; two holds far apart as route 2."""
    places = [(0.3 * (k % 2), 0.0, 0.4 + 0.35 * k) for k in range(8)]
    places += [(3.0, 0.0, 1.5), (3.0, 0.0, 1.7), (3.0, 0.0, 5.0)]
    rows = tuple(
        Hold(
            id=k + 1,
            kind="hold",
            type="jug",
            colour="red",
            colour_rgb=(200, 0, 0),
            position=place,
            normal=(0.0, -1.0, 0.0),
            size=0.12,
            area=0.01,
            steepness_deg=0.0,
            photos=(),
            score=1.0,
            route=1 if k < 8 else 2,
        )
        for k, place in enumerate(places)
    )
    routes = (
        Route(1, holds=tuple(range(1, 9)), start=(3, 4), top=(8,), grade="5"),
        Route(2, holds=(9, 10, 11), start=(9, 10), top=(11,)),
    )
    folder = ScanFolder(tmp_path)
    Holds(metric=True, holds=rows).save(folder.holds)
    Routes(routes=routes).save(folder.routes)
    Manifest.load(folder.manifest).save(folder.manifest)
    return tmp_path


def test_climbing_moves_are_written_for_every_body(
    wall: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["moves", str(wall), "--height", "1.62"]) == 0
    ladder, far = Moves.load(ScanFolder(wall).moves).routes
    assert [row.climber for row in ladder.climbers] == ["child", "short", "adult", "tall", "you"]
    assert all(row.reached and row.moves[-1].holds[:2] == (8, 8) for row in ladder.climbers)
    assert ladder.grade is not None
    assert not any(row.reached for row in far.climbers)
    assert far.grade is None
    assert "child does not reach the top" in capsys.readouterr().out
    script = ScanFolder(wall).moves_script.read_text()
    message = json.loads(script.removeprefix("window.wallTopoMoves=").rstrip().rstrip(";"))
    assert message == json.loads(ScanFolder(wall).moves.read_text())


class _Notes(Silent):
    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, message: str) -> None:
        self.notes.append(message)


def test_an_edit_renews_the_moves_of_the_same_bodies(wall: Path) -> None:
    folder = ScanFolder(wall)
    step = Step(EXPORT, folder)
    renew_inputs(step, _Notes())
    assert not folder.moves.exists(), "nobody requested moves"
    assert main(["moves", str(wall), "--height", "1.62"]) == 0
    written = folder.moves.stat().st_mtime_ns
    renew_inputs(step, _Notes())
    assert folder.moves.stat().st_mtime_ns == written, "holds and routes are the same"
    ladder, far = Routes.load(folder.routes).routes
    Routes(routes=(msgspec.structs.replace(ladder, top=(7,)), far)).save(folder.routes)
    renew_inputs(step, _Notes())
    row = Moves.load(folder.moves).routes[0].climbers[-1]
    assert (row.climber, row.height) == ("you", 1.62)
    assert row.moves[-1].holds[:2] == (7, 7)
    assert folder.moves_script.stat().st_mtime_ns > written


def test_moves_that_cannot_be_renewed_stop_no_export(wall: Path) -> None:
    folder, progress = ScanFolder(wall), _Notes()
    folder.moves.write_text("{")
    renew_inputs(Step(EXPORT, folder), progress)
    (note,) = progress.notes
    assert note.startswith("moves.json is not renewed: ")


def test_climbing_grade_is_a_range_and_leans_on_other_routes(
    wall: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["grade", str(wall), "--format", "json"]) == 0
    easy, far = json.loads(capsys.readouterr().out)["routes"]
    assert (easy["grade"], easy["low"], easy["graded"]) == ("5", "3", 0)
    assert far["low"] == ""


def test_climbing_a_reach_needs_a_height(wall: Path) -> None:
    assert main(["moves", str(wall), "--reach", "1.7"]) == 2
    assert not ScanFolder(wall).moves.exists()
