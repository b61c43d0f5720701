"""`walltopo problem` and `walltopo ease`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from spray import spray_wall  # type: ignore[import-not-found]

from walltopo.cli import main
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.routes import Route, Routes
from walltopo.scans.scale import Scale


@pytest.fixture
def wall(tmp_path: Path) -> Path:
    folder = ScanFolder(tmp_path)
    Holds(metric=True, holds=spray_wall(30)).save(folder.holds)
    Routes(routes=(Route(1, holds=(1, 2), start=(1,), top=(2,)),)).save(folder.routes)
    Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True).save(
        folder.scale
    )
    return tmp_path


def test_setting_a_problem_is_reported(wall: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["problem", str(wall), "--grade", "6C-7B", "--moves", "4", "--count", "1"]
    assert main([*command, "--format", "json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert len(result["proposals"]) == 1
    assert main(command) == 0
    out = capsys.readouterr().out
    numbers = ", ".join(map(str, result["proposals"][0]["hands"]))
    assert f"holds {numbers}" in out
    assert "child" in out
    assert main([*command, "--put", "2"]) == 2
    assert not ScanFolder(wall).edits.exists()


def test_setting_refuses_plainly(wall: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["problem", str(wall), "--grade", "hard"]) == 3
    assert main(["ease", str(wall), "7"]) == 3
    assert "route 7 does not exist" in capsys.readouterr().err
    assert main(["ease", str(wall), "1"]) == 3
    assert "no sequence to its top" in capsys.readouterr().err
