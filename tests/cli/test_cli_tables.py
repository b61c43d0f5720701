"""The tables on the terminal: routes by name, holds counted by one rule, 80 columns."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from walltopo.cli import main
from walltopo.cli.console import Terminal
from walltopo.cli.listener import describe_metrics
from walltopo.cli.scan import _show_result
from walltopo.pipeline.plan import names_of_plan
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.manifest import Manifest, StageRecord
from walltopo.scans.routes import Route, Routes, route_name

UP = (0.0, 0.0, 1.0)


def _row(id: int, kind: str = "hold") -> Hold:
    return Hold(
        id=id,
        kind=kind,
        type="jug",
        colour="red",
        colour_rgb=(200, 40, 40),
        position=UP,
        normal=UP,
        size=0.1,
        area=0.01,
        steepness_deg=3.0,
        photos=("a.jpg",),
        score=0.9,
        route=1,
    )


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """Tables on a terminal of 80 columns."""
    stream = io.StringIO()
    console = Terminal(file=stream, width=80, highlight=False, markup=False, emoji=False)
    monkeypatch.setattr("walltopo.cli.console.console", console)
    return stream


def test_routes_are_called_as_on_the_page() -> None:
    assert route_name(Route(id=3, colour="red")) == "Red 3"
    assert route_name(Route(id=3, colour="red", name="Owl")) == "Owl"
    assert route_name(Route(id=3)) == "Route 3"


def test_the_result_names_routes(tmp_path: Path, terminal: io.StringIO) -> None:
    folder = ScanFolder(tmp_path)
    routes = (Route(id=1, name="The Owl", holds=(1, 2)), Route(id=2, colour="blue"))
    Routes(routes=routes).save(folder.routes)
    rows = (_row(1), _row(2), _row(3, "volume"))
    Holds(metric=True, holds=rows).save(folder.holds)
    _show_result(tmp_path)
    output = terminal.getvalue()
    for word in ("2 routes, 2 holds, 1 volume", "The Owl", "Blue 2"):
        assert word in output


def test_status_fits_eighty_columns(tmp_path: Path, terminal: io.StringIO) -> None:
    manifest = Manifest.load(tmp_path / "none")
    metrics = {f"figure {k}": k * 1000 for k in range(12)}
    names = names_of_plan(part=False)
    for name in names:
        record = StageRecord("done", seconds=12_345.6, peak_mb=23_456.0, metrics=metrics)
        manifest.stages[name] = record
    manifest.stages["lift"] = StageRecord("interrupted", seconds=1.0)
    manifest.save(ScanFolder(tmp_path).manifest)
    assert main(["status", str(tmp_path)]) == 1
    lines = [line.rstrip() for line in terminal.getvalue().splitlines()]
    table = [line for line in lines if line.split(" ")[0] in names]
    assert len(table) == len(names), "a line a stage"
    assert max(map(len, lines[:-1])) <= 80
    assert lines[-1].endswith(f"would run now: walltopo scan -o {tmp_path}")


def test_figures_are_whole_or_left_out() -> None:
    metrics = {"photos": 20, "masks": 568, "masks_per_photo": 28.4}
    assert describe_metrics(metrics) == "photos 20, masks 568, masks per photo 28.4"
    assert describe_metrics(metrics, 30) == "photos 20, masks 568"
    assert describe_metrics(metrics, 3) == "photos 20"
