"""Finding programs, their progress, their logs and errors."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from walltopo.core import EnvironmentLacksError, Silent, StageError
from walltopo.reconstruct.openmvs import PROGRAMS, find_programs, parse_progress, run_program


class Recorder(Silent):
    def __init__(self) -> None:
        self.done = 0

    def advance(self, count: int = 1) -> None:
        self.done += count


def program(name: str) -> Path:
    path = shutil.which(name)
    assert path is not None
    return Path(path)


def test_missing_programs_are_named(tmp_path: Path) -> None:
    with pytest.raises(EnvironmentLacksError) as caught:
        find_programs(str(tmp_path))
    assert all(name in str(caught.value) for name in PROGRAMS)


@pytest.mark.parametrize(
    ("line", "what", "percent"),
    [
        ("Estimated depth-maps 12 (16.67%, 3s, ETA 15s)", "Estimated depth-maps", 16.67),
        ("Fused depth-maps 72 (100%, 18s)", "Fused depth-maps", 100.0),
        ("Points weighted 8 (1%, 1s)...Points weighted 9 (2%, 2s)", "Points weighted", 2.0),
        ("16:20:31 [App     ] Command line: scene.mvs", None, 0.0),
    ],
)
def test_progress_lines(line: str, what: str | None, percent: float) -> None:
    step = parse_progress(line)
    assert (step.task if step else None) == what
    if step:
        assert step.percent == percent


def test_progress_and_log_of_any_program(tmp_path: Path) -> None:
    recorder = Recorder()
    run_program(program("echo"), ["Fused depth-maps 72 (100%, 18s)"], tmp_path, recorder)
    assert recorder.done == 100
    assert f"-w {tmp_path}" in (tmp_path / "echo.log").read_text()


def test_a_failing_program_shows_its_last_words(tmp_path: Path) -> None:
    with pytest.raises(StageError, match=r"(?s)code 3.*last words"):
        run_program(program("sh"), ["-c", "echo last words; exit 3"], tmp_path, Silent())
