"""The child process: progress from log lines, failures as errors, refused options."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from walltopo.core import Silent, StageError
from walltopo.reconstruct.sparse.jobs import ColmapJob, MapTask, Sift, run_worker


class Recorder(Silent):
    """Keeps its messages."""

    def __init__(self) -> None:
        self.steps: list[tuple[str, int | None]] = []
        self.done = 0
        self.details: list[str] = []

    def step(self, what: str, total: int | None = None) -> None:
        self.steps.append((what, total))

    def advance(self, count: int = 1) -> None:
        self.done += count

    def detail(self, message: str) -> None:
        self.details.append(message)


def job(
    threads: int = 1, database: str = "", image_root: str = "", map: MapTask | None = None
) -> ColmapJob:
    """A job of no photos."""
    return ColmapJob(
        database, image_root, threads, 0, Sift(500, 0), 15, cameras=(), images=(), map=map
    )


def fake_worker(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, body: str) -> None:
    """Make `run_worker` start a script in place of the worker."""
    script = tmp_path / "child.py"
    script.write_text(body, encoding="utf-8")
    real = subprocess.Popen

    def start(command: list[str], **options: Any) -> Any:
        return real([sys.executable, str(script)], **options)

    monkeypatch.setattr(subprocess, "Popen", start)


def test_log_lines_become_progress(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    glog = "I20260101 10:00:00.000000 1234 {}] {}"
    lines = [
        '@walltopo {"step": "features", "total": 2}',
        glog.format("feature_extraction.cc:270", "Processed file [1/2]"),
        glog.format("feature_extraction.cc:273", "  Name: a.jpg"),
        glog.format("feature_extraction.cc:270", "Processed file [2/2]"),
        '@walltopo {"step": "matches", "total": 130, "block": 100}',
        glog.format("feature_matching.cc:218", "in 1.776s"),
        glog.format("feature_matching.cc:218", "in 0.776s"),
        '@walltopo {"models": {"0": 2}}',
    ]
    fake_worker(monkeypatch, tmp_path, f"print({chr(10).join(lines)!r})")
    recorder = Recorder()
    assert run_worker(job(), recorder).models == {"0": 2}
    assert recorder.steps == [("find features", 2), ("match photos", 130)]
    assert recorder.done == 132
    assert recorder.details[1] == "colmap: Name: a.jpg"


def test_an_aborted_child_is_an_error_with_its_last_words(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    event = json.dumps({"step": "register", "total": 3})
    body = (
        "import os, sys\n"
        f"print('@walltopo ' + {event!r}, flush=True)\n"
        "print('F20260101 10:00:00.000000 1 a.cc:1] Check failed: x > 0', flush=True)\n"
        "os.abort()\n"
    )
    fake_worker(monkeypatch, tmp_path, body)
    with pytest.raises(StageError, match=r"signal 6 during the step 'register(?s:.*)Check failed"):
        run_worker(job(threads=-1), Silent())


def test_ctrl_c_kills_the_child(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    fake_worker(monkeypatch, tmp_path, "import time\nprint('x', flush=True)\ntime.sleep(60)")
    children: list[Any] = []
    start = subprocess.Popen

    def keep(*args: Any, **options: Any) -> Any:
        children.append(start(*args, **options))
        return children[-1]

    monkeypatch.setattr(subprocess, "Popen", keep)

    class Interrupting(Silent):
        def detail(self, message: str) -> None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_worker(job(), Interrupting())
    assert children[0].poll() is not None


def test_the_worker_tells_what_is_wrong_with_its_job(tmp_path: Path) -> None:
    task = MapTask("/proc/nowhere", expected=0)
    wrong = job(database=str(tmp_path / "f.db"), image_root=str(tmp_path), map=task)
    with pytest.raises(StageError, match="COLMAP failed"):
        run_worker(wrong, Silent())
