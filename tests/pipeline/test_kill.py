"""A scan killed with SIGKILL in each stage in turn ends as an undisturbed one does."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.breakpoints.breakpoint import Breakpoint

from walltopo.pipeline.plan import names_of_plan
from walltopo.scans.manifest import Manifest

# Those of `tiny_scan`.
SETTINGS = ["--set", "sparse.threads=1", "--set", "texture.size=512"]


def _command(photos: Path, out: Path) -> list[str]:
    return [sys.executable, "-m", "walltopo", "scan", str(photos), "-o", str(out), "-q", *SETTINGS]


def _state(out: Path, stage: str) -> str:
    record = Manifest.load(out / "scan.json").stages.get(stage)
    return "not run" if record is None else record.state


def _run_and_kill_in(photos: Path, out: Path, stage: str, child_breakpoint: Breakpoint) -> str:
    """Start the scan and kill it in `stage`; return the state that the manifest then has."""
    process = subprocess.Popen(
        _command(photos, out), start_new_session=True, env=child_breakpoint.at(f"stage:{stage}")
    )
    try:
        child_breakpoint.wait(process)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    return _state(out, stage)


@pytest.mark.slow
def test_killed_in_every_stage(
    tiny_photos: Path, tiny_scan: Path, tmp_path: Path, child_breakpoint: Breakpoint
) -> None:
    killed = tmp_path / "killed"
    for stage in names_of_plan(part=False):
        assert _run_and_kill_in(tiny_photos, killed, stage, child_breakpoint) == "running"
        # Whatever is in the folder is whole: every JSON parses, no temporary has a final name.
        for path in killed.glob("*.json"):
            json.loads(path.read_text())
    subprocess.run(_command(tiny_photos, killed), check=True)
    for name in ("holds.json", "routes.json"):
        assert (killed / name).read_bytes() == (tiny_scan / name).read_bytes()
    assert not list(killed.glob(".partial-*"))
