"""Ctrl-C and SIGTERM end a command, whatever the libraries in it do."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.breakpoints.breakpoint import Breakpoint

from walltopo.scans.manifest import Manifest

# Both take the same way through a command; one of them in each quick run.
EACH_SIGNAL = [pytest.param(signal.SIGINT, marks=pytest.mark.slow), signal.SIGTERM]
SWALLOWS = """
    try:
        ready()
        time.sleep(600)
    except BaseException:  # as some libraries do around an import
        pass
    time.sleep(600)
"""
IN_NATIVE_CODE = """
    import hashlib
    ready()
    hashlib.pbkdf2_hmac("sha256", b"wall", b"topo", 2**31 - 1)
"""
RAISES_ANOTHER = """
    try:
        ready()
        time.sleep(600)
    except BaseException:
        raise ImportError("could not import the other library")
"""
AFTER_COLMAP = """
    from walltopo.geometry.colmap import pycolmap
    ready()
    time.sleep(600)
"""
AFTER_COLMAP_IN_A_THREAD = """
    import importlib, threading
    importing = threading.Thread(target=importlib.import_module, args=("walltopo.geometry.colmap",))
    importing.start()
    importing.join()
    ready()
    time.sleep(600)
"""
# A command of another distribution, as an entry point would add it.
PROGRAM = """
import sys, time
import walltopo.cli as cli

def ready():
    print("ready", flush=True)

def work(args):
    {body}

def register(commands):
    commands.add_parser("work").set_defaults(run=work)

cli._add_plugins = register
sys.exit(cli.main(["work"]))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    "body", [SWALLOWS, IN_NATIVE_CODE, RAISES_ANOTHER, AFTER_COLMAP, AFTER_COLMAP_IN_A_THREAD]
)
def test_a_signal_ends_a_command(body: str, number: signal.Signals) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(body=body.strip())],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        output = process.communicate(timeout=900)[1]
    finally:
        process.kill()
    assert process.returncode == 128 + number
    assert output.strip() == "stopped; run the same command again to continue"


def _state(out: Path, stage: str) -> str:
    record = Manifest.load(out / "scan.json").stages.get(stage)
    return "not run" if record is None else record.state


def _stop(
    arguments: list[str], number: signal.Signals, child_breakpoint: Breakpoint, place: str
) -> None:
    """Start a command, send it the signal at a place, and check what it says and returns."""
    command = [sys.executable, "-m", "walltopo", *arguments]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=child_breakpoint.at(place),
    )
    try:
        child_breakpoint.wait(process)
        process.send_signal(number)
        output = process.communicate(timeout=900)[1]
    finally:
        process.kill()
    assert process.returncode == 128 + number
    assert output.strip() == "stopped; run the same command again to continue"


@pytest.mark.parametrize("number", EACH_SIGNAL)
def test_a_stopped_scan_says_so(
    tiny_photos: Path, tmp_path: Path, number: signal.Signals, child_breakpoint: Breakpoint
) -> None:
    out = tmp_path / "scan"
    _stop(["scan", str(tiny_photos), "-o", str(out)], number, child_breakpoint, "stage:sparse")
    # On a busy machine it may have been ended before it had noted that.
    assert _state(out, "sparse") in ("interrupted", "running")


def _detect(gym: Path, out: Path) -> list[str]:
    return ["detect", str(gym / "photos"), "-o", str(out / "found.json"), "--draw", str(out / "p")]


def _lift(gym: Path, out: Path) -> list[str]:
    given = {"mesh": "mesh.ply", "cameras": "cameras", "masks": "noisy.json"}
    paths = [f"--{name}={gym / 'lift' / file}" for name, file in given.items()]
    return ["lift", *paths, "-o", str(out / "lifted")]


@pytest.mark.data
@pytest.mark.parametrize("number", EACH_SIGNAL)
@pytest.mark.parametrize("make", [_detect, _lift])
def test_a_stopped_command_writes_nothing(
    make: Callable[[Path, Path], list[str]],
    number: signal.Signals,
    gym_a: Path,
    tmp_path: Path,
    child_breakpoint: Breakpoint,
) -> None:
    _stop(make(gym_a, tmp_path), number, child_breakpoint, "rename")
    # Native code may keep a file from being removed: it has a partial name, never a result's.
    left = [path for path in tmp_path.rglob("*") if ".partial-" not in str(path)]
    assert not [path for path in left if path.is_file()]
