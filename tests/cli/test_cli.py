"""The command line as a user meets it."""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import walltopo
from walltopo.cli import COMMANDS, build_parser, main

HEAVY = (
    "cv2",
    "pycolmap",
    "numba",
    "scipy",
    "trimesh",
    "onnxruntime",
    "torch",
    "networkit",
    "starlette",
    "uvicorn",
    "asyncio",
)


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert walltopo.__version__ in capsys.readouterr().out


def test_every_command_has_help() -> None:
    parser = build_parser()
    actions = [a for a in parser._actions if hasattr(a, "choices") and a.choices]
    commands = actions[-1].choices
    assert commands is not None
    for name in ("scan", "status", "view", "doctor", "lift", "detect", "export", "evaluate"):
        assert name in commands


@pytest.mark.parametrize("word", COMMANDS)
def test_a_command_is_registered_by_the_module_of_its_entry(word: str) -> None:
    def commands(parser: argparse.ArgumentParser) -> set[str]:
        return {name for a in parser._actions for name in (a.choices or ())}

    of_module = {name for name, module in COMMANDS.items() if module == COMMANDS[word]}
    assert commands(build_parser(word)) == of_module
    assert commands(build_parser()) > of_module


def test_no_command_prints_help_and_fails(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert "exit codes" in capsys.readouterr().out


@pytest.mark.parametrize(
    "code",
    [
        "import walltopo",
        "import walltopo.pipeline.settings",
        "from walltopo.cli import build_parser as b; b()",
    ],
)
def test_importing_is_light(code: str) -> None:
    check = f"{code}; import sys; print([m for m in {HEAVY!r} if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_help_needs_no_numpy() -> None:
    code = "from walltopo.cli import main; main(['--help'])"
    check = f"import sys, contextlib\nwith contextlib.suppress(SystemExit): {code}"
    words = [sys.executable, "-c", f"{check}\nprint('numpy' in sys.modules)"]
    out = subprocess.run(words, capture_output=True, text=True, check=True)
    assert out.stdout.split()[-1] == "False"


def test_lift_and_scan_stay_functions_whatever_is_imported() -> None:
    check = (
        "import inspect, walltopo, walltopo.segment.lift.settings, walltopo.pipeline.runner, "
        "walltopo.scans.folder; is_function = inspect.isfunction; "
        "print(is_function(walltopo.lift), is_function(walltopo.scan))"
    )
    out = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert out.stdout.split() == ["True", "True"]


def test_status_of_something_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["status", str(tmp_path)]) == 3
    assert "not a scan folder" in capsys.readouterr().err


def test_view_before_the_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["view", str(tmp_path)]) == 3
    assert "no page to show" in capsys.readouterr().err


def test_settings_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["settings", "lift"]) == 0
    assert "threshold" in capsys.readouterr().out
    assert main(["settings", "lfit"]) == 2


def test_doctor_reports(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) in (0, 5)
    out = capsys.readouterr().out
    for topic in ("memory", "disk", "HEIC", "OpenMVS", "models", "GPU", "Chromium"):
        assert topic in out


def test_doctor_names_the_line_that_mends(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = importlib.util.find_spec
    gone = ("networkit", "walltopo_gym", "ray", "obstore")
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name, *rest: None if name in gone else found(name, *rest)
    )
    only = {"apt-get": "/usr/bin/apt-get"}  # Debian without the programs
    monkeypatch.setattr("shutil.which", lambda name, *rest, **more: only.get(name))
    assert main(["doctor", "--json"]) == 5
    output = json.loads(capsys.readouterr().out)
    by_topic = {finding["topic"]: finding for finding in output["findings"]}
    assert output["ready"] is False
    assert by_topic["packages"]["state"] == "problem"
    assert "networkit" in by_topic["packages"]["detail"]
    assert by_topic["packages"]["install"] == "pip install --force-reinstall walltopo"
    assert by_topic["walltopo-gym"]["install"] == "pip install walltopo-gym"
    for extra in ("ray", "s3"):
        assert by_topic[f"extra {extra}"]["state"] == "missing"
        assert by_topic[f"extra {extra}"]["install"] == f"pip install 'walltopo[{extra}]'"
    assert by_topic["Chromium"]["install"] == "sudo apt-get install chromium"


@pytest.mark.parametrize(("before", "after"), [(None, "1"), ("4", "4")])
def test_small_products_run_in_one_thread(
    before: str | None, after: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS")
    if before is not None:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", before)
    with pytest.raises(SystemExit):
        main(["--version"])
    assert os.environ["OPENBLAS_NUM_THREADS"] == after
