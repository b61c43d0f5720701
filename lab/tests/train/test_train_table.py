"""The table of families and variants: what is planned, what must be there, what is printed."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("torch")
pytest.importorskip("onnx")


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    from walltopo_lab.benchmarks import detector_table

    return detector_table


def sources_of(table: Any, folder: Path) -> Any:
    return table.Sources(
        (folder / "train",), folder / "test", folder, folder / "coco", folder / "tuned",
        "mobile-sam", 5.0, "cpu",
    )  # fmt: skip


def test_three_families_four_variants_n_runs(table: Any) -> None:
    runs = table.plan(list(table.NETWORKS), table.VARIANTS, 3, "s")
    assert len(runs) == 36
    assert [r.title for r in runs[::3]][:4] == [
        "yolo11-seg", "yolo11-seg-pt", "yolo11-seg-aug", "yolo11-seg-hyp",
    ]  # fmt: skip
    assert {r.network for r in runs} == {"yolo11s-seg", "yolo11s", "rtdetr-l"}
    assert len({r.folder for r in runs}) == 36


def test_what_is_lacking_is_told_first(
    table: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WALLTOPO_CACHE", str(tmp_path / "cache"))
    sources = sources_of(table, tmp_path)
    assert table.lacking(table.plan(["yolo11-seg"], ["scratch"], 1, "n"), sources) == []
    runs = table.plan(["yolo11-sam"], ["pt", "hyp"], 2, "n")
    missing = table.lacking(runs, sources)
    assert [Path(m.split(" ")[0]).name for m in missing] == [
        "yolo11n.pt", "yolo11n.toml", "mobile_sam.pt",
    ]  # fmt: skip
    (tmp_path / "coco").mkdir()
    (tmp_path / "coco" / "yolo11n.pt").write_bytes(b"")
    assert len(table.lacking(runs, sources)) == 2
    words = ["table", str(tmp_path), "--test", str(tmp_path), "-o", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit, match=r"(?s)files are lacking.*rtdetr-l\.pt"):
        table.main()
    assert not (tmp_path / "out").exists()


def test_tuned_settings_reach_the_training(
    table: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tuned").mkdir()
    (tmp_path / "tuned" / "yolo11s-seg.toml").write_text("rate = 0.02\nsize = 960\n")
    (run,) = table.plan(["yolo11-seg"], ["hyp"], 1, "s")
    asked: list[Any] = []
    monkeypatch.setattr(table, "train_yolo", lambda *given: asked.append(given))
    sources = sources_of(table, tmp_path)
    table.train_run(run, sources)
    job, network, settings, augment, _ = asked[0]
    assert (network, settings.rate, settings.size, settings.minutes) == (
        "yolo11s-seg",
        0.02,
        960,
        5,
    )
    assert augment.mosaic == 1.0
    assert job.pretrained == tmp_path / "coco" / "yolo11s-seg.pt"
    (plain,) = table.plan(["yolo11-seg"], ["scratch"], 1, "s")
    table.train_run(plain, sources)
    assert asked[1][0].pretrained is None
    assert asked[1][3].mosaic == 0.0


def test_means_and_spreads(table: Any) -> None:
    rows = {
        "yolo11-seg": [{"boxes AP50": 0.5, "boxes AP": 0.2}, {"boxes AP50": 0.7, "boxes AP": 0.2}]
    }
    printed = table.markdown(rows).splitlines()
    assert printed[2] == "| yolo11-seg | 2 | 0.600 ± 0.141 | 0.200 ± 0.000 | - | - |"
