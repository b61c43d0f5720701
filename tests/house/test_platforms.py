"""A scan and its view need nothing that only Linux has."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from walltopo.scans.manifest import Manifest

HIDING = Path(__file__).parent / "without_linux"
SETTINGS = ("sparse.threads=1", "texture.size=512", "dense.edge_length=0.016")


def environment() -> dict[str, str]:
    path = os.pathsep.join([str(HIDING), *sys.path])
    return {**os.environ, "PYTHONPATH": path, "PYTHONWARNDEFAULTENCODING": "1"}


def python(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], env=environment(), capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("import fcntl", "no fcntl on this system"),
        ("import resource", "no resource on this system"),
        ("from pathlib import Path; Path('/proc/meminfo').read_bytes()", "no such file on this"),
        ("import os; os.fork()", "has no attribute 'fork'"),
        ("open('/dev/null')", "EncodingWarning"),
    ],
)
def test_the_test_hides_it_from_walltopo_alone(line: str, message: str, tmp_path: Path) -> None:
    package = tmp_path / "walltopo"
    package.mkdir()
    (package / "__init__.py").write_text(f"{line}\n")
    hidden = python("-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import walltopo")
    assert hidden.returncode != 0
    assert message in hidden.stderr
    if "os.fork" not in line:
        other = python("-c", line)
        assert other.returncode == 0, other.stderr


@pytest.mark.slow
def test_a_scan_and_its_page(tiny_photos: Path, tmp_path: Path) -> None:
    out = tmp_path / "scan"
    settings = [part for setting in SETTINGS for part in ("--set", setting)]
    done = python("-m", "walltopo", "scan", tiny_photos, "-o", out, *settings)
    assert done.returncode == 0, done.stdout + done.stderr
    stages = Manifest.load(out / "scan.json").stages
    assert {record.state for record in stages.values()} == {"done"}
    assert "GiB" in python("-m", "walltopo", "doctor").stdout
    assert python("-m", "walltopo", "status", out).returncode == 0
    view = subprocess.Popen(
        [sys.executable, "-m", "walltopo", "view", out, "--port", "0"],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert view.stdout is not None
    shown = ""
    for line in view.stdout:
        shown += line
        if found := re.search(r"http://\S+", line):
            with urllib.request.urlopen(found[0]) as answer:
                assert "<wall-topo" in answer.read().decode()
            break
    view.send_signal(signal.SIGINT)
    rest, _ = view.communicate()
    assert view.returncode == 0, shown + rest
