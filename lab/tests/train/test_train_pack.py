"""A pack of prepared photos: it holds what training needs, and trains in worker processes."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from lab.tests.train.networks import SMALL

from walltopo.cli import main
from walltopo.core import InputError, Silent, StageError
from walltopo_lab.train import loop, pack
from walltopo_lab.train.batches import CropSource
from walltopo_lab.train.cache import open_cache
from walltopo_lab.train.choose import check_on
from walltopo_lab.train.detector import Job, fit_detector
from walltopo_lab.train.net import NET_SIZES
from walltopo_lab.train.pack import open_pack, write_pack
from walltopo_lab.train.params import AugmentSettings, TrainSettings
from walltopo_lab.train.sets import LabelledSet, open_sets
from walltopo_lab.train.supply import supply

DiscSet = Callable[..., Path]


def sets_in(folder: Path, disc_set: DiscSet, count: int = 4) -> list[LabelledSet]:
    return open_sets([disc_set(folder / "discs", count)], folder / "cache", 0.3, Silent())


def test_a_pack_holds_photos_labels_and_the_split(tmp_path: Path, disc_set: DiscSet) -> None:
    sets = sets_in(tmp_path, disc_set)
    size = write_pack(tmp_path / "a.pack", sets, Silent(), shares=[1.0])
    assert size == (tmp_path / "a.pack").stat().st_size
    made = open_pack(tmp_path / "a.pack", tmp_path / "elsewhere", Silent())
    assert made.shares == (1.0,)
    (item,), (before,) = made.sets, sets
    assert (item.train, item.held_out, item.exact) == (before.train, before.held_out, False)
    for name in (*item.train, *item.held_out):
        old, new = open_cache(before.folder, name), open_cache(item.folder, name)
        np.testing.assert_array_equal(old.ids, new.ids)
        np.testing.assert_array_equal(old.boxes, new.boxes)
        np.testing.assert_array_equal(old.hulls, new.hulls)
        difference = np.abs(old.image.astype(int) - new.image.astype(int))
        assert difference.mean() < 8, "only WebP's losses"


def test_a_damaged_pack_is_refused(
    tmp_path: Path, disc_set: DiscSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    sets = sets_in(tmp_path, disc_set)
    with pytest.raises(InputError, match="no such pack"):
        open_pack(tmp_path / "none.pack", tmp_path, Silent())
    (tmp_path / "text.pack").write_text("no pack")
    with pytest.raises(InputError, match="not a pack"):
        open_pack(tmp_path / "text.pack", tmp_path, Silent())
    row = {"name": "..", "exact": False, "train": [], "held_out": [], "dropped": []}
    for facts in ({"format": 2}, {"format": 1, "sets": [row], "shares": None}):
        with zipfile.ZipFile(tmp_path / "bad.pack", "w") as archive:
            archive.writestr("pack.json", json.dumps(facts))
        with pytest.raises(InputError, match="not a pack"):
            open_pack(tmp_path / "bad.pack", tmp_path, Silent())
    monkeypatch.setattr(pack, "MAX_BYTES", 1000)
    with pytest.raises(InputError, match="the pack would have"):
        write_pack(tmp_path / "large.pack", sets, Silent())
    assert not (tmp_path / "large.pack").exists()


def test_the_command_writes_a_pack(
    tmp_path: Path, disc_set: DiscSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WALLTOPO_CACHE", str(tmp_path / "cache"))
    data = disc_set(tmp_path / "discs")
    assert main(["train", "pack", str(data), "-o", str(tmp_path / "discs.pack")]) == 0
    assert len(open_pack(tmp_path / "discs.pack", tmp_path, Silent()).sets) == 1
    both = ["train", str(data), "--pack", str(tmp_path / "discs.pack"), "-o", str(tmp_path / "r")]
    assert main(both) != 0
    assert main(["train", "-o", str(tmp_path / "r")]) != 0


@pytest.mark.slow
def test_a_pack_trains_in_workers_and_resumes_after_a_kill(
    tmp_path: Path, disc_set: DiscSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(NET_SIZES, "lite2", SMALL)
    monkeypatch.setattr(loop, "_SAVE_EVERY", 0.0)
    write_pack(tmp_path / "discs.pack", sets_in(tmp_path, disc_set), Silent())
    settings = TrainSettings(
        minutes=100.0,
        crop=96,
        batch=8,
        workers=2,
        rate=1e-2,
        warmup=0.0,
        audit=0.0,
        check_every=1e9,
        check_photos=1,
        start="random",
    )
    job = Job((), tmp_path / "run", pack=tmp_path / "discs.pack")
    losses: list[float] = []
    update = loop._training_step

    def stop_after(steps: int) -> None:
        def counted(*args: object) -> dict[str, float]:
            if len(losses) == steps:
                raise RuntimeError("killed")
            made = update(*args)  # type: ignore[arg-type]
            losses.append(made["heat"] + made["box"] + made["mask"])
            return made

        monkeypatch.setattr(loop, "_training_step", counted)
        with pytest.raises(RuntimeError, match="killed"):
            fit_detector(job, settings, AugmentSettings(), Silent())

    stop_after(10)
    first = loop.load_run(job.out / "checkpoint.pt", settings)
    assert first.step == 10
    stop_after(20)
    second = loop.load_run(job.out / "checkpoint.pt", settings)
    assert second.step == 20
    assert second.seconds > first.seconds
    assert np.mean(losses[-5:]) < 0.9 * np.mean(losses[:5])
    folder = next(job.cached.glob("pack-*/*"))
    photo = next(folder.glob("*.labels.npz")).name.removesuffix(".labels.npz")
    assert "score" in check_on(second.average.eval(), [(folder, photo)])


def test_a_dead_worker_ends_the_training(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from walltopo_lab.train import supply as module

    monkeypatch.setattr(module, "_ALIVE_EVERY", 0.2)
    settings = TrainSettings(crop=96, batch=1, workers=1)
    source = CropSource([(tmp_path, ["gone.jpg"])], [1.0], settings, AugmentSettings())
    crops = supply(source, 0, torch.device("cpu"))
    with pytest.raises(StageError, match="process that makes crops"):
        next(crops)
