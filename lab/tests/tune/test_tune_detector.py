"""Successive halving over a detector's training: stops, resumes, reports."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from walltopo.core import InputError, Silent
from walltopo_lab.train.params import TrainSettings, YoloSettings, read_values
from walltopo_lab.tune import detector as room
from walltopo_lab.tune.detector import (
    DetectorSearch,
    model_name,
    open_search,
    run_search,
    trials_of,
)
from walltopo_lab.tune.detector_report import best_trial, write_search


def search_in(folder: Path, family: str = "votes") -> tuple[DetectorSearch, Any]:
    search = DetectorSearch(family, (folder / "set",), folder / "out", 9.0)
    search.out.mkdir(exist_ok=True)
    return search, open_search(search, f"sqlite:///{search.out / 'study.db'}", family, 0)


@pytest.fixture
def trained(monkeypatch: pytest.MonkeyPatch) -> list[tuple[dict[str, Any], int]]:
    """Trainings whose AP50 grows to momentum, larger networks slower; (values, steps) of each."""
    done: list[tuple[dict[str, Any], int]] = []

    def train(
        search: DetectorSearch,
        values: Mapping[str, Any],
        folder: Path,
        seen: Callable[[int, float], None],
        progress: Any,
    ) -> None:
        done.append((dict(values), 0))
        for step in range(1, room.CHECKS + 1):
            done[-1] = (dict(values), step)
            seen(step, values["momentum"] * step / room.CHECKS)

    monkeypatch.setattr(room, "_train_trial", train)
    return done


def test_what_falls_behind_is_stopped(
    tmp_path: Path, trained: list[tuple[dict[str, Any], int]]
) -> None:
    search, study = search_in(tmp_path)
    run_search(study, search, 12, Silent())
    trials = trials_of(study)
    assert len(trials) == 12
    stopped = [t for t in trials if t.stopped]
    assert 3 <= len(stopped) < 12
    assert {max(t.steps) for t in stopped} <= {1, 3, 9}
    assert [max(t.steps) for t in trials] == [steps for _, steps in trained]
    best = best_trial(trials)
    assert best.best == pytest.approx(best.values["momentum"])
    for t in trials:
        assert 1e-4 <= t.values["rate"] <= 1e-1
        assert t.values["batch"] in (2, 4, 8, 16, 32)


def test_resumes_from_its_storage(
    tmp_path: Path, trained: list[tuple[dict[str, Any], int]]
) -> None:
    search, study = search_in(tmp_path)
    run_search(study, search, 3, Silent())
    search, again = search_in(tmp_path)
    run_search(again, search, 5, Silent())
    assert len(trained) == 5
    run_search(again, search, 5, Silent())
    assert len(trained) == 5
    other = DetectorSearch("votes", search.datasets, search.out, 10.0)
    with pytest.raises(InputError, match="else"):
        open_search(other, f"sqlite:///{search.out / 'study.db'}", "votes", 0)


@pytest.mark.parametrize("family", ["votes", "rtdetr"])
def test_the_result_is_what_train_reads(
    tmp_path: Path, family: str, trained: list[tuple[dict[str, Any], int]]
) -> None:
    search, study = search_in(tmp_path, family)
    run_search(study, search, 4, Silent())
    trials = trials_of(study)
    write_search(search.out, search, trials)
    best = best_trial(trials).values
    kind = TrainSettings if family == "votes" else YoloSettings
    values = read_values(search.out / "tuned.toml", kind)
    assert values["batch"] == best["batch"]
    assert values["crop" if family == "votes" else "size"] == best["size"]
    assert values["rate"] == pytest.approx(best["rate"], rel=1e-4)
    output = (search.out / "tuned.toml").read_text()
    assert tomllib.loads(output)
    assert f"--model {'votes' if family == 'votes' else 'rtdetr-' + best['network']}" in output
    assert f"Best: trial {best_trial(trials).number}" in (search.out / "report.md").read_text()
    assert (search.out / "search.png").stat().st_size > 5000


def test_each_family_trains_with_what_was_suggested(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from walltopo_lab.train import detector, yolo

    requests: dict[str, Any] = {}
    monkeypatch.setattr(
        detector,
        "fit_detector",
        lambda job, settings, *rest: requests.update(votes=(job, settings)),
    )
    monkeypatch.setattr(
        yolo,
        "fit_yolo",
        lambda job, name, settings, *rest: requests.update(yolo=(job, name, settings)),
    )
    values = {"rate": 2e-3, "momentum": 0.8, "batch": 4, "size": 384, "network": "m"}

    def ignore(step: int, value: float) -> None: ...

    search, _ = search_in(tmp_path)
    small = {**values, "network": "lite1"}
    room._train_trial(search, small, tmp_path / "t", ignore, Silent())
    job, settings = requests["votes"]
    assert (settings.crop, settings.network, settings.momentum) == (384, "lite1", 0.8)
    assert job.cached == search.out / "cache"
    search = DetectorSearch("yolo11-seg", (), tmp_path, 5.0, pretrained=tmp_path / "coco")
    room._train_trial(search, values, tmp_path / "t", ignore, Silent())
    job, name, yolo_settings = requests["yolo"]
    assert name == "yolo11m-seg"
    assert job.pretrained == tmp_path / "coco" / "yolo11m-seg.pt"
    assert (yolo_settings.size, yolo_settings.rate) == (384, 2e-3)
    assert model_name("yolo11", "x") == "yolo11x"


def test_no_trial_to_its_end_is_no_result() -> None:
    with pytest.raises(InputError, match="trial"):
        best_trial([])
    with pytest.raises(InputError, match="family"):
        DetectorSearch("yolo99", (), Path("x"), 1.0)
