"""The same batch and the same scan by a Ray cluster of two processes: the same bytes, none lost."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NoReturn

import numpy as np
import psutil
import pytest
from numpy.typing import NDArray
from tests.pipeline.batch.quick_scans import SETTINGS, write_list, writer_of

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.pipeline.batch.listed import read_list
from walltopo.pipeline.batch.run import run_on_cluster
from walltopo.pipeline.ray_workers import RayWorkers, on_cluster
from walltopo.pipeline.runner import run_stage, scan
from walltopo.pipeline.settings import load_settings
from walltopo.reconstruct.dense.settings import DenseSettings
from walltopo.scans.folder import ScanFolder
from walltopo.segment.detect.settings import DetectSettings

GB = 1 << 30


@pytest.fixture(scope="module")
def cluster(lacks: Callable[[str], NoReturn]) -> Iterator[None]:
    """A cluster of this module's own, on this machine."""
    try:
        import ray  # noqa: F401
    except ImportError:
        lacks("Ray is not installed (pip install 'walltopo[ray]')")
    with on_cluster("local"):
        yield


# Functions of a test are carried whole: the cluster's processes cannot import it.
def test_results_come_in_order(cluster: None, tmp_path: Path) -> None:
    def told(name: str, number: int) -> tuple[str, int, int]:
        return name, number, os.getpid()

    found = list(RayWorkers().within(tmp_path).map(lambda: "shared", told, range(20)))
    assert [(name, number) for name, number, _ in found] == [("shared", k) for k in range(20)]
    assert os.getpid() not in {process for _, _, process in found}


def test_large_results_are_left_as_files(cluster: None, tmp_path: Path) -> None:
    def large(side: int, value: int) -> NDArray[np.float64]:
        return np.full((side, side), float(value))

    for value, found in enumerate(RayWorkers().within(tmp_path).map(lambda: 512, large, range(6))):
        assert (found == value).all()
    assert list(tmp_path.iterdir()) == []


def test_errors_are_those_of_the_work(cluster: None, tmp_path: Path) -> None:
    def refuse(shared: None, name: str) -> None:
        raise InputError(f"{name}: cannot be read", "Take another.")

    with pytest.raises(InputError, match="photo 3: cannot") as told:
        list(RayWorkers().within(tmp_path).map(lambda: None, refuse, ["photo 3"]))
    assert told.value.hint == "Take another."


def test_a_lost_process_costs_its_task_only(cluster: None, tmp_path: Path) -> None:
    mark, scratch = tmp_path / "mark", tmp_path / "scratch"
    scratch.mkdir()

    def die_once(shared: None, number: int) -> int:
        if number == 3 and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return number**2

    found = RayWorkers().within(scratch).map(lambda: None, die_once, range(8))
    assert list(found) == [k**2 for k in range(8)]
    assert mark.exists()


def test_more_than_any_machine_has(cluster: None) -> None:
    with pytest.raises(EnvironmentLacksError, match="no machine"):
        list(run_on_cluster([], 4096, GB))


def _kill_worker_of(log: Path) -> None:
    """Kill the Ray process above the one that writes this log."""
    os.kill(psutil.Process(writer_of(log)).ppid(), signal.SIGKILL)


@pytest.fixture(scope="module")
def alone(tiny_photos: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scan without a cluster: what it makes is what a cluster must make."""
    out = tmp_path_factory.mktemp("alone") / "wall"
    scan(tiny_photos, out, load_settings(None, SETTINGS.split()))
    return out


def test_a_batch_with_a_killed_worker(
    cluster: None, alone: Path, tiny_photos: Path, tmp_path: Path
) -> None:
    jobs = read_list(write_list(tmp_path, tiny_photos, ["wall"]))
    with ThreadPoolExecutor(1) as pool:
        killed = pool.submit(_kill_worker_of, tmp_path / "wall" / "scan.log")
        (outcome,) = run_on_cluster(jobs, 1, GB)
        killed.result()
    assert outcome.state == "done", outcome.error
    log = (tmp_path / "wall" / "scan.log").read_text(encoding="utf-8")
    assert log.count("-- begun") == 2
    assert (tmp_path / "wall" / "holds.json").read_bytes() == (alone / "holds.json").read_bytes()


@pytest.mark.parametrize(
    ("stage", "settings", "made"),
    [
        ("detect", DetectSettings(size=480), "detections.json"),
        ("dense", DenseSettings(max_size=320), "mesh.ply"),
    ],
)
def test_a_stage_makes_the_same_bytes(
    cluster: None, tiny_scan: Path, tmp_path: Path, stage: str, settings: object, made: str
) -> None:
    for name in ("here", "there"):
        shutil.copytree(tiny_scan, tmp_path / name)
        (tmp_path / name / made).unlink()
    run_stage(ScanFolder(tmp_path / "here"), stage, settings)
    run_stage(ScanFolder(tmp_path / "there"), stage, settings, workers=RayWorkers())
    assert (tmp_path / "there" / made).read_bytes() == (tmp_path / "here" / made).read_bytes()


def test_without_the_extra(tmp_path: Path) -> None:
    (tmp_path / "ray.py").write_text("raise ImportError('not here')\n")
    listed = write_list(tmp_path, tmp_path, ["a"])
    run = subprocess.run(
        [sys.executable, "-m", "walltopo", "batch", str(listed), "--ray", "local"],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}"},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 5
    assert "walltopo[ray]" in run.stderr


@pytest.mark.parametrize("address", ["127.0.0.1:1", "127.0.0.1:70000"])
def test_a_head_that_is_not_there(address: str, lacks: Callable[[str], NoReturn]) -> None:
    if importlib.util.find_spec("ray") is None:
        lacks("Ray is not installed (pip install 'walltopo[ray]')")
    with pytest.raises(EnvironmentLacksError, match="no Ray cluster"), on_cluster(address):
        pass
