"""A batch by processes of this machine: what is lost is done again, what fails stays alone."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from tests.breakpoints.breakpoint import Breakpoint
from tests.pipeline.batch.quick_scans import stage_seconds, write_list

from walltopo.cli import main
from walltopo.pipeline.batch.job import ScanJob, run_job

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Batch:
    """A batch that ended: its folder, its outcomes by scan, and which scan was killed."""

    folder: Path
    outcomes: dict[str, Any]
    killed: str
    calm: str


@pytest.fixture(scope="module")
def done(tiny_photos: Path, tmp_path_factory: pytest.TempPathFactory) -> Batch:
    """A batch of two scans and of one that cannot be, in which one scan's process was killed."""
    folder = tmp_path_factory.mktemp("batch")
    child_breakpoint = Breakpoint(tmp_path_factory.mktemp("breakpoint") / "reached")
    listed = write_list(folder, tiny_photos, ["one", "other"])
    listed.write_text(listed.read_text() + "nowhere,missing,\n")
    run = [sys.executable, "-m", "walltopo", "batch", str(listed), "-j", "2", "--json"]
    batch = subprocess.Popen(
        run,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env=child_breakpoint.at("first:sparse"),
    )
    try:
        pid = child_breakpoint.wait(batch)
        os.kill(pid, signal.SIGKILL)
        out, output = batch.communicate(timeout=1800)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(batch.pid, signal.SIGKILL)
        batch.wait()
    assert batch.returncode == 1, output
    assert "nowhere" in output
    names = ["one", "other"]
    killed = next(n for n in names if f"process {pid}" in (folder / n / "scan.log").read_text())
    names.remove(killed)
    outcomes = {Path(o["out"]).name: o for o in json.loads(out)}
    return Batch(folder, outcomes, killed, names[0])


def test_a_killed_scan_is_done_again(done: Batch) -> None:
    assert {name: o["state"] for name, o in done.outcomes.items()} == {
        done.calm: "done",
        done.killed: "done",
        "missing": "failed",
    }
    assert done.outcomes[done.killed]["tries"] == 2
    assert done.outcomes[done.calm]["tries"] == 1
    assert done.outcomes[done.killed]["holds"] > 0
    killed, calm = (done.folder / name / "holds.json" for name in (done.killed, done.calm))
    assert killed.read_bytes() == calm.read_bytes()


def test_each_scan_has_its_log(done: Batch) -> None:
    log = (done.folder / done.killed / "scan.log").read_text(encoding="utf-8")
    assert log.count("-- started") == 2
    assert "✓ export" in log
    assert list((done.folder / "missing").glob("[!.]*")) == []


def test_a_second_run_computes_nothing(done: Batch, capsys: pytest.CaptureFixture[str]) -> None:
    calm = done.folder / done.calm
    before = stage_seconds(calm)
    assert main(["batch", str(done.folder / "list.csv"), "-j", "1"]) == 1
    output = capsys.readouterr().out
    assert output.count("up to date") >= 2
    assert "2 of 3 scans are done" in output
    assert stage_seconds(calm) == before


def test_a_scan_that_dies_each_time_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("walltopo.pipeline.batch.job._MODULE", "walltopo.no_such_module")
    outcome = run_job(ScanJob(photos=("a",), out=str(tmp_path / "b")), tries=2)
    assert (outcome.state, outcome.tries) == ("lost", 2)
    assert "exit code 1" in outcome.error


def test_unknown_settings_end_it_before_the_first_scan(tmp_path: Path) -> None:
    listed = write_list(tmp_path, tmp_path, ["a"], "lift.treshold=1")
    assert main(["batch", str(listed)]) == 2
    assert not (tmp_path / "a").exists()
