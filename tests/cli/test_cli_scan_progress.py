"""The one bar of a scan, its lines in a log, and the checks of the machine before it."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest

from walltopo.cli import main
from walltopo.cli.console import Terminal
from walltopo.cli.scan_progress import ScanListener, rough_duration
from walltopo.pipeline.forecast import Forecast
from walltopo.pipeline.runner import scan
from walltopo.pipeline.stages import STAGES, stage_named
from walltopo.scans.manifest import StageRecord


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def _terminal(width: int = 80) -> tuple[Terminal, io.StringIO]:
    stream = io.StringIO()
    return Terminal(file=stream, width=width, force_terminal=True, color_system=None), stream


@pytest.mark.parametrize(
    ("seconds", "output"),
    [
        (0, "under a minute"),
        (49, "under a minute"),
        (55, "about 1 min"),
        (250, "about 4 min"),
        (59.6 * 60, "about 1 h"),
        (83 * 60, "about 1 h 25 min"),
    ],
)
def test_an_estimate_promises_little(seconds: float, output: str) -> None:
    assert rough_duration(seconds) == output


def test_the_bar_says_stage_share_and_time_left() -> None:
    console, _ = _terminal()
    clock = Clock()
    listener = ScanListener(console, clock=clock)
    listener.scan_begins(Forecast(["dense", "texture"], 20, {}))
    listener.stage_begins("dense")
    listener.step("depth maps", 20)
    listener.advance(7)
    clock.now = stage_named("dense").cost.of(20) / 2
    share, what, left = listener._status()
    assert what == "dense    depth maps 7/20"
    assert 0.2 < share < 0.5
    assert left == "about 1 min left"


def test_it_fits_a_terminal() -> None:
    console, stream = _terminal()
    with ScanListener(console) as listener:
        listener.scan_begins(Forecast([stage.name for stage in STAGES], 1200, {}))
        listener.stage_begins("classify")
        listener.step("looking at the colours of every hold in every photo there is", 1200)
        listener.advance(1199)
        listener._bar.refresh()
    drawn = [
        line for line in stream.getvalue().replace("\r", "\n").split("\n") if "1199/1200" in line
    ]
    assert drawn
    assert all("left" in line for line in drawn), "the time must not be cut off"


def _lines(photos: Path, out: Path) -> list[str]:
    stream = io.StringIO()
    with ScanListener(Terminal(file=stream, width=200)) as listener:
        scan(photos, out, to_stage="ingest", listener=listener)
    return stream.getvalue().splitlines()


def test_a_log_gets_one_line_and_none_when_nothing_is_to_do(
    tiny_photos: Path, tmp_path: Path
) -> None:
    first = _lines(tiny_photos, tmp_path / "scan")
    count = len(list(tiny_photos.glob("*.jpg")))
    assert first[0] == f"  {count} photos: under a minute (estimate)"
    again = _lines(tiny_photos, tmp_path / "scan")
    assert not [line for line in again if "estimate" in line]


def test_a_stage_that_fails_is_not_counted_as_measured() -> None:
    console, stream = _terminal()
    listener = ScanListener(console)
    listener.scan_begins(Forecast(["ingest", "sparse"], None, {}))
    listener.stage_ends("ingest", StageRecord("failed", metrics={"photos": 3}))
    assert "estimate" not in stream.getvalue()


@pytest.mark.parametrize(
    ("setting", "code", "output"),
    [
        ("dense.backend=openmvs", 5, "OpenMVS"),
        ("texture.backend=openmvs", 5, "OpenMVS"),
        ("detect.model=nowhere.onnx", 3, "nowhere.onnx"),
        ("detect.model=no-such-detector", 3, "no-such-detector"),
    ],
)
def test_what_a_late_stage_lacks_is_reported_before_the_first(
    setting: str,
    code: int,
    output: str,
    tiny_photos: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    words = ["scan", str(tiny_photos), "-o", "scan", "--set", setting]
    assert main(words) == code
    assert output in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "scan" / "photos").exists()
    # A run that does not come so far does not ask.
    assert main([*words, "--to", "ingest", "-q"]) == 0
    stages = json.loads((tmp_path / "scan" / "scan.json").read_text())["stages"]
    assert list(stages) == ["ingest"]
