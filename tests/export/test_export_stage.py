"""The stage as a whole: files, page, report, refusals."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from walltopo.core import InputError, Silent
from walltopo.export.contract import ExportSettings
from walltopo.export.stage import run
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]


def test_writes_everything(make_scan: MakeScan) -> None:
    scan = make_scan()
    metrics = run(scan, ExportSettings(), Silent())
    assert metrics["holds"] == 12
    assert metrics["routes"] == 4
    rows = json.loads(scan.holds.read_text())
    assert rows["metric"] is True
    assert [row["route"] for row in rows["holds"]] == [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]
    names = {path.name for path in (scan.root / "page").iterdir()}
    assert names == {"viewer.js", "start.js", "first.glb", "first.js", "detail.glb", "detail.js"}
    script = (scan.root / "page" / "first.js").read_text()
    packed = re.search(r'="([^"]+)"', script)
    assert packed is not None
    assert base64.b64decode(packed.group(1)) == (scan.root / "page" / "first.glb").read_bytes()
    assert not list(scan.root.rglob(".partial-*"))


def test_page_and_report_name_no_other_host(make_scan: MakeScan) -> None:
    scan = make_scan()
    run(scan, ExportSettings(title="<script>window.hacked=1</script>"), Silent())
    for path in (scan.page, scan.report):
        text = path.read_text()
        assert not re.search(r'(src|href)="(https?:)?//', text)
        assert "<script>window.hacked" not in text
        assert "&lt;script&gt;window.hacked=1" in text
    assert "too few &lt;b&gt;matches" in scan.report.read_text()


@pytest.mark.parametrize("options", [{"holds": 0}, {"textured": False}, {"cameras": False}])
def test_poor_scans_still_export(make_scan: MakeScan, options: dict[str, Any]) -> None:
    scan = make_scan(cells=24, **options)
    metrics = run(scan, ExportSettings(), Silent())
    assert metrics["glb_triangles"] > 0
    assert scan.report.is_file()


def test_report_tells_what_went_wrong(make_scan: MakeScan) -> None:
    scan = make_scan(metric=False)
    run(scan, ExportSettings(), Silent())
    text = scan.report.read_text()
    assert "unscaled" in text
    assert "3 of 4" in text
    assert "IMG_4.jpg" in text
    assert "0.34 px" in text


def test_labels_of_another_mesh_are_refused(make_scan: MakeScan) -> None:
    scan = make_scan()
    np.savez(scan.instances, face_instance=np.zeros(7, np.int32), face_score=np.zeros(7))
    with pytest.raises(InputError, match="different runs"):
        run(scan, ExportSettings(), Silent())


def test_same_input_same_files(make_scan: MakeScan) -> None:
    one, two = make_scan("one"), make_scan("two")
    for scan in (one, two):
        run(scan, ExportSettings(title="same"), Silent())
    for name in ("wall.glb", "holds.json", "page/first.glb", "index.html"):
        assert (one.root / name).read_bytes() == (two.root / name).read_bytes()


def test_without_meshoptimizer_it_says_so_and_goes_on(
    make_scan: MakeScan, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("surface", "tiers", "stage"):
        monkeypatch.setattr(f"walltopo.export.{module}.available", lambda: False)
    notes: list[str] = []

    class Listener(Silent):
        def note(self, message: str) -> None:
            notes.append(message)

    scan = make_scan()
    metrics = run(scan, ExportSettings(first_triangles=1000), Listener())
    assert metrics["first_triangles"] == metrics["glb_triangles"]
    assert b"EXT_meshopt_compression" not in (scan.root / "page" / "first.glb").read_bytes()
    assert any("meshoptimizer is not installed" in note for note in notes)
