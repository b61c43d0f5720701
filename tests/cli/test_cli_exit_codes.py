"""Each exit code that the help names, by a command that ends so."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from walltopo.cli import EXIT_CODES
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


@pytest.mark.parametrize(("code", "make"), CASES)
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
    told = {int(code) for code in re.findall(r"^ +(\d+) ", EXIT_CODES, re.M)}
    signals = {130}  # test_cli_stopping.py
    assert told == {code for code, _ in CASES} | {70} | signals
