"""The stage as a whole: files, page, report, refusals."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from jinja2 import UndefinedError
from made_scan import MARKUP, export_alone, export_scan  # type: ignore[import-not-found]
from msgspec import structs

from walltopo.core import InputError, Silent
from walltopo.publish.settings import ExportSettings
from walltopo.publish.wall_data import read_wall
from walltopo.publish.wall_files import PageFiles
from walltopo.publish.web_page import render
from walltopo.scans.artifacts import artifacts_of
from walltopo.scans.folder import ScanFolder, write_moves
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.instances import InstanceTable
from walltopo.scans.moves import Moves, moves_basis
from walltopo.scans.page_labels import PageLabels
from walltopo.scans.routes import Routes

MakeScan = Callable[..., ScanFolder]


def test_writes_everything(make_scan: MakeScan) -> None:
    scan = make_scan()
    metrics = export_scan(scan)
    assert metrics["holds"] == 12
    assert metrics["routes"] == 4
    rows = Holds.load(scan.holds)
    assert rows.metric is True
    assert [row.route for row in rows.holds] == [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]
    names = {path.name for path in (scan.root / "page").iterdir()}
    tiers = {f"{name}.{kind}" for name in ("first", "detail") for kind in ("glb", "js")}
    assert names == {"viewer.js", "start.js", "labels.json", "labels.js"} | tiers
    script = (scan.root / "page" / "first.js").read_text()
    packed = re.search(r'="([^"]+)"', script)
    assert packed is not None
    assert base64.b64decode(packed.group(1)) == (scan.root / "page" / "first.glb").read_bytes()
    labels = (scan.root / "page" / "labels.json").read_text()
    assert f'["labels.json"]={labels};' in (scan.root / "page" / "labels.js").read_text()
    assert PageLabels.load(scan.root / "page" / "labels.json").holds == rows.holds
    assert not list(scan.root.rglob(".partial-*"))


class Opened(HTMLParser):
    """The tags, attributes and text that a browser would find in a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.text = ""
        self.feed(path.read_text())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_data(self, data: str) -> None:
        self.text += data


def test_page_and_report_name_no_other_host(make_scan: MakeScan) -> None:
    scan = make_scan()
    export_scan(scan)
    for path in (scan.page, scan.report):
        assert not re.search(r'(src|href)="(https?:)?//', path.read_text())


def test_names_stay_text(make_scan: MakeScan) -> None:
    hostile = "\"'><script>window.hacked=1</script>"
    scan = make_scan()
    table = Holds.load(scan.holds)
    first, second, *others = table.holds
    renamed = structs.replace(second, type=hostile, review=True)
    structs.replace(table, holds=(first, renamed, *others)).save(scan.holds)
    doubtful = Hold(99, "hold", position=(0.0, 1.0, 2.5), left_out=hostile)
    found = Holds.load(scan.holds)
    structs.replace(found, left_out=(doubtful,)).save(scan.holds)
    export_scan(scan, ExportSettings(title=hostile))
    page, report = Opened(scan.page), Opened(scan.report)
    assert ("heading", hostile) in page.attributes
    assert page.tags.count("script") == 2
    assert "script" not in report.tags
    assert not [name for name, _ in report.attributes if name.startswith("on")]
    # Title and heading, the hold, what was left out; a route, a photo and a skipped file.
    assert report.text.count(hostile) == 4
    assert MARKUP in report.text
    assert "too few <b>matches</b>" in report.text
    assert "<script>window.hacked=1</script>.txt" in report.text


def test_a_name_that_a_template_lacks_is_an_error() -> None:
    with pytest.raises(UndefinedError, match="title"):
        render("page", "index.html.jinja", assets="page")


def test_a_scan_without_holds_still_exports(make_scan: MakeScan) -> None:
    scan = make_scan(cells=24, holds=0)
    metrics = export_scan(scan)
    assert metrics["glb_triangles"] > 0
    assert scan.report.is_file()


def test_a_wall_without_texture_still_exports(make_scan: MakeScan, tmp_path: Path) -> None:
    """A gym merged of scans of which one has none."""
    wall = replace(read_wall(make_scan(cells=24)), uv=None, texture=None)
    scan = export_alone(tmp_path / "gym", wall, ExportSettings())
    assert len(Holds.load(scan.holds).holds) == 12
    for path in (scan.glb, scan.page, scan.page_assets / "first.glb"):
        assert path.is_file()


@pytest.mark.parametrize(
    "name",
    [name for name, item in artifacts_of(PageFiles) if item.made_by and not item.optional],
)
def test_what_is_missing_is_named_with_the_stage_that_makes_it(
    make_scan: MakeScan, name: str
) -> None:
    scan = make_scan(cells=24)
    path: Path = getattr(scan, name)
    made_by = dict(artifacts_of(PageFiles))[name].made_by
    path.rename(path.with_name("gone"))
    with pytest.raises(InputError, match=re.escape(str(path))) as caught:
        export_scan(scan)
    assert f"stage {made_by} writes" in str(caught.value)
    assert not scan.glb.exists()


def test_the_page_asks_for_moves_where_there_are_some(make_scan: MakeScan) -> None:
    scan = make_scan(cells=24)
    export_scan(scan)
    assert "moves.json" not in scan.page.read_text()
    basis = moves_basis(Holds.load(scan.holds).holds, Routes.load(scan.routes).routes)
    write_moves(scan, Moves(made_for=basis, routes=()))
    export_scan(scan)
    assert 'moves="moves.json"' in scan.page.read_text()


def test_moves_of_other_holds_are_not_shown(make_scan: MakeScan) -> None:
    scan = make_scan(cells=24)
    holds = Holds.load(scan.holds).holds
    basis = moves_basis(holds[1:], Routes.load(scan.routes).routes)
    write_moves(scan, Moves(made_for=basis, routes=()))
    export_scan(scan)
    assert "moves.json" not in scan.page.read_text()


def test_report_tells_what_went_wrong(make_scan: MakeScan) -> None:
    scan = make_scan(metric=False)
    export_scan(scan)
    text = scan.report.read_text()
    assert "unscaled" in text
    assert "3 of 4" in text
    assert "IMG_4.jpg" in text
    assert "0.34 px" in text


def test_labels_of_another_mesh_are_refused(make_scan: MakeScan) -> None:
    scan = make_scan()
    InstanceTable(np.zeros(7, np.int32), np.zeros(7, np.float32)).save(scan.instances)
    with pytest.raises(InputError, match="different runs"):
        export_scan(scan)


def test_same_input_same_files(make_scan: MakeScan) -> None:
    one, two = make_scan("one"), make_scan("two")
    for scan in (one, two):
        export_scan(scan, ExportSettings(title="same"))
    for name in ("wall.glb", "holds.json", "page/first.glb", "page/labels.json", "index.html"):
        assert (one.root / name).read_bytes() == (two.root / name).read_bytes()


def test_without_meshoptimizer_it_says_so_and_goes_on(
    make_scan: MakeScan, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("surface", "tiers", "outputs"):
        monkeypatch.setattr(f"walltopo.publish.{module}.available", lambda: False)
    notes: list[str] = []

    class Listener(Silent):
        def note(self, message: str) -> None:
            notes.append(message)

    scan = make_scan()
    metrics = export_scan(scan, ExportSettings(first_triangles=1000), Listener())
    assert metrics["first_triangles"] == metrics["glb_triangles"]
    assert b"EXT_meshopt_compression" not in (scan.root / "page" / "first.glb").read_bytes()
    assert any("meshoptimizer is not installed" in note for note in notes)
