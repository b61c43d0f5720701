"""The built wheels, installed into an empty environment, can do what the checkout can."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PHOTOS = 6


def run(*command: object, expect: int = 0) -> str:
    """Run a command; its output. Far from the checkout, so that nothing is imported from there."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, cwd="/", check=False
    )
    assert done.returncode == expect, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh virtual environment with the wheel of walltopo alone, and both wheels beside it."""
    root = tmp_path_factory.mktemp("wheels")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "-q")
    for project in (ROOT, ROOT / "lab"):
        # A copy: setuptools leaves build/ and *.egg-info behind.
        copy = root / f"source-{project.name}"
        shutil.copytree(
            project, copy, ignore=shutil.ignore_patterns(".*", "node_modules", "build", "*-scan")
        )
        run(*pip, "wheel", "--no-deps", "-w", root / "dist", copy)
    run(sys.executable, "-m", "venv", root / "venv")
    wheel = next((root / "dist").glob("walltopo-*.whl"))
    inside = (root / "venv" / "bin" / "python", "-m", "pip", "--disable-pip-version-check", "-q")
    run(*inside, "install", "-c", ROOT / "constraints.txt", wheel)
    return root


@pytest.mark.slow
def test_the_product_alone(environment: Path, tmp_path: Path) -> None:
    walltopo = environment / "venv" / "bin" / "walltopo"
    assert "models" in run(walltopo, "doctor")
    told = run(walltopo, "synth", "x", expect=5)
    assert "walltopo-lab" in told
    photos = sorted((ROOT / "examples" / "demo-photos").glob("*.jpg"))[:PHOTOS]
    run(walltopo, "scan", *photos, "-o", tmp_path / "scan", "--to", "scale")
    assert (tmp_path / "scan" / "scale.json").is_file()
    # What is no Python must be in the wheel too.
    inside = (
        "import walltopo.export as e, walltopo, pathlib; root = pathlib.Path(e.__file__).parent; "
        "print(len(list(root.rglob('*.jinja'))), (root / 'page' / 'viewer.js').is_file(), "
        "len(list((root.parent / 'models').glob('*.onnx'))))"
    )
    templates, viewer, models = run(environment / "venv" / "bin" / "python", "-c", inside).split()
    assert int(templates) >= 2
    assert viewer == "True"
    assert int(models) >= 2


@pytest.mark.slow
def test_the_lab_adds_its_commands(environment: Path) -> None:
    python = environment / "venv" / "bin" / "python"
    lab = next((environment / "dist").glob("walltopo_lab-*.whl"))
    run(python, "-m", "pip", "--disable-pip-version-check", "-q", "install", "--no-deps", lab)
    assert "--preset" in run(environment / "venv" / "bin" / "walltopo", "synth", "--help")
