"""The same batch and the same scan by a Ray cluster of two processes: the same bytes, none lost."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NoReturn

import psutil
import pytest
from tests.breakpoints.breakpoint import Breakpoint
from tests.pipeline.batch.quick_scans import SETTINGS, write_list

from walltopo.core import EnvironmentLacksError
from walltopo.pipeline.batch.job_list import read_list
from walltopo.pipeline.batch.run import on_cluster, run_on_cluster
from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings

GB = 1 << 30


@pytest.fixture(scope="module")
def cluster(
    lacks: Callable[[str], NoReturn], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Breakpoint]:
    """A cluster of this module's own, on this machine; the first scan stops in a stage."""
    try:
        import ray  # noqa: F401
    except ImportError:
        lacks("Ray is not installed (pip install 'walltopo[ray]')")
    child_breakpoint = Breakpoint(tmp_path_factory.mktemp("breakpoint") / "reached")
    with pytest.MonkeyPatch.context() as patch:
        for name, value in child_breakpoint.at("first:sparse").items():
            patch.setenv(name, value)
        with on_cluster("local"):
            yield child_breakpoint


# Functions of a test are carried whole: the cluster's processes cannot import it.


@pytest.mark.slow
def test_more_than_any_machine_has(cluster: Breakpoint) -> None:
    with pytest.raises(EnvironmentLacksError, match="no machine"):
        list(run_on_cluster([], 4096, GB))


def _kill_worker(child_breakpoint: Breakpoint) -> None:
    """Kill the Ray process above the scan that stopped."""
    os.kill(psutil.Process(child_breakpoint.wait()).ppid(), signal.SIGKILL)


@pytest.fixture(scope="module")
def alone(tiny_photos: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scan without a cluster: what it makes is what a cluster must make."""
    out = tmp_path_factory.mktemp("alone") / "wall"
    scan(tiny_photos, out, load_settings(None, SETTINGS.split()))
    return out


@pytest.mark.slow
def test_a_batch_with_a_killed_worker(
    cluster: Breakpoint, alone: Path, tiny_photos: Path, tmp_path: Path
) -> None:
    jobs = read_list(write_list(tmp_path, tiny_photos, ["wall"]))
    with ThreadPoolExecutor(1) as pool:
        killed = pool.submit(_kill_worker, cluster)
        (outcome,) = run_on_cluster(jobs, 1, GB)
        killed.result()
    assert outcome.state == "done", outcome.error
    log = (tmp_path / "wall" / "scan.log").read_text(encoding="utf-8")
    assert log.count("-- started") == 2
    assert (tmp_path / "wall" / "holds.json").read_bytes() == (alone / "holds.json").read_bytes()


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
