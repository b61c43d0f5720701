"""A batch by processes of this machine: what is lost is done again, what fails stays alone."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from tests.pipeline.batch.quick_scans import stage_seconds, write_list, writer_of

from walltopo.cli import main
from walltopo.pipeline.batch.job import ScanJob, run_job

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def done(tiny_photos: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A batch of two scans and of one that cannot be, in which one scan's process was killed."""
    folder = tmp_path_factory.mktemp("batch")
    listed = write_list(folder, tiny_photos, ["calm", "killed"])
    listed.write_text(listed.read_text() + "nowhere,missing,\n")
    run = [sys.executable, "-m", "walltopo", "batch", str(listed), "-j", "2", "--json"]
    batch = subprocess.Popen(run, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    pid = writer_of(folder / "killed" / "scan.log")
    killing = threading.Thread(target=os.kill, args=(pid, signal.SIGKILL))
    killing.start()
    out, output = batch.communicate(timeout=900)
    killing.join()
    (folder / "out.json").write_text(out)
    assert batch.returncode == 1, output
    assert "nowhere" in output
    return folder


def test_a_killed_scan_is_done_again(done: Path) -> None:
    outcomes = {Path(o["out"]).name: o for o in json.loads((done / "out.json").read_text())}
    assert {name: o["state"] for name, o in outcomes.items()} == {
        "calm": "done",
        "killed": "done",
        "missing": "failed",
    }
    assert outcomes["killed"]["tries"] == 2
    assert outcomes["killed"]["holds"] > 0
    assert (done / "killed" / "holds.json").read_bytes() == (
        done / "calm" / "holds.json"
    ).read_bytes()


def test_each_scan_has_its_log(done: Path) -> None:
    log = (done / "killed" / "scan.log").read_text(encoding="utf-8")
    assert log.count("-- started") == 2
    assert "✓ export" in log
    assert list((done / "missing").glob("[!.]*")) == []


def test_a_second_run_computes_nothing(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = stage_seconds(done / "calm")
    assert main(["batch", str(done / "list.csv"), "-j", "1"]) == 1
    output = capsys.readouterr().out
    assert output.count("up to date") >= 2
    assert "2 of 3 scans are done" in output
    assert stage_seconds(done / "calm") == before


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
