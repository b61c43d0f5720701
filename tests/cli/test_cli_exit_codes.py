"""Each exit code that the help names, by a command that ends so."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from walltopo.cli import EXIT_CODES, _report
from walltopo.cli.stopping import Stop
from walltopo.scans.manifest import Manifest

DEFECT = """
import sys
import walltopo.cli as cli

def work(args):
    raise RuntimeError("the wrong branch")

cli._add_plugins = lambda commands: commands.add_parser("work").set_defaults(run=work, verbose={})
sys.exit(cli.main(["work"]))
"""


def _photos(folder: Path) -> Path:
    """Sharp photos that show nothing in common."""
    folder.mkdir()
    for seed in range(4):
        blocks = np.random.default_rng(seed).integers(0, 255, (60, 80, 3), dtype=np.uint8)
        picture = Image.fromarray(blocks).resize((640, 480), Image.Resampling.NEAREST)
        picture.save(folder / f"p{seed}.jpg")
    return folder


def _unfinished(folder: Path) -> list[str]:
    Manifest.load(folder / "none").save(folder / "scan.json")
    return ["status", str(folder)]


def _scan(*more: str) -> Callable[[Path], list[str]]:
    def words(folder: Path) -> list[str]:
        return ["scan", str(_photos(folder / "in")), "-o", str(folder / "scan"), *more]

    return words


def _words(*words: str) -> Callable[[Path], list[str]]:
    return lambda folder: [word.format(folder) for word in words]


CASES: list[tuple[int, Callable[[Path], list[str]]]] = [
    (0, _words("settings", "lift")),
    (0, _words("--version")),
    (0, _words("scan", "--help")),
    (1, _unfinished),
    (2, _words("status")),
    (2, _words("nonsense")),
    (2, _words("status", "{}", "--colour")),
    (2, _scan("--set", "lift.nonsense=1")),
    (3, _words("status", "{}/nowhere")),
    (3, _words("scan", "{}/nowhere", "-o", "{}/scan")),
    (4, _scan("--to", "sparse")),
    (5, _scan("--dense", "openmvs", "--set", "dense.openmvs_bin={}")),
]


def _run(command: list[str], cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd)


# The code 4 takes a whole scan of photos that do not fit together.
@pytest.mark.parametrize(
    ("code", "make"),
    [pytest.param(*case, marks=[pytest.mark.slow] if case[0] == 4 else []) for case in CASES],
)
def test_it_ends_as_the_help_says(
    code: int, make: Callable[[Path], list[str]], tmp_path: Path
) -> None:
    words = [word.replace("{}", str(tmp_path)) for word in make(tmp_path)]
    run = _run([sys.executable, "-m", "walltopo", *words], tmp_path)
    assert run.returncode == code
    assert ("Traceback" in run.stderr) is False
    assert bool(run.stderr) == (code > 1), "what went wrong is on stderr, and nothing else is"


@pytest.mark.parametrize("verbose", [False, True])
def test_a_defect_is_70(verbose: bool, tmp_path: Path) -> None:
    run = _run([sys.executable, "-c", DEFECT.format(verbose)], tmp_path)
    assert run.returncode == 70
    assert "RuntimeError" in run.stderr
    assert ("Traceback" in run.stderr) == verbose


def test_every_code_of_the_help_is_tried() -> None:
    output = {int(code) for code in re.findall(r"^ +(\d+) ", EXIT_CODES, re.M)}
    signals = {130}  # test_cli_stopping.py
    assert output == {code for code, _ in CASES} | {70} | signals


def _ended(words: list[str], **how: Any) -> subprocess.CompletedProcess[bytes]:
    command = [sys.executable, "-m", "walltopo", *words]
    return subprocess.run(command, stderr=subprocess.PIPE, check=False, **how)


def test_a_name_that_is_too_long_is_bad_input(tmp_path: Path) -> None:
    done = _ended(["status", str(tmp_path / ("a" * 300))])
    assert done.returncode == 3
    assert b"name too long" in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_stdout_is_the_machine_s_fault() -> None:
    with open("/dev/full", "wb") as full:
        done = _ended(["settings", "--markdown"], stdout=full)
    assert done.returncode == 5
    assert b"No space left" in done.stderr


def test_a_deleted_working_folder_is_no_defect(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    path = f"PYTHONPATH={':'.join(sys.path)}"
    script = f'cd "{gone}" && rmdir "{gone}" && {path} "{sys.executable}" -m walltopo status scan'
    done = subprocess.run(["sh", "-c", script], capture_output=True, check=False)
    assert done.returncode in (3, 5), done.stderr
    assert b"defect" not in done.stderr


def test_a_terminal_without_the_character_shows_its_code() -> None:
    how = {"env": {**os.environ, "PYTHONIOENCODING": "ascii"}, "stdout": subprocess.PIPE}
    assert _ended(["doctor"], **how).returncode in (0, 5)


def test_a_scan_inside_another_scan_is_refused(tmp_path: Path) -> None:
    Manifest.load(tmp_path / "none").save(tmp_path / "scan.json")
    (tmp_path / "photos").mkdir()
    inside = tmp_path / "photos" / "x"
    done = _ended(["scan", str(_photos(tmp_path / "in")), "-o", str(inside)])
    assert done.returncode == 3
    assert b"lies among the files of the scan" in done.stderr
    assert not inside.exists()


def test_an_interruption_that_a_library_turns_into_an_os_error_stays_one() -> None:
    stop = Stop()
    stop.number = signal.SIGINT
    assert _report(OSError(4, "Interrupted system call"), stop, False) == 130
