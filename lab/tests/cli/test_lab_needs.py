"""A command of the lab reports what it lacks before it does anything."""

from __future__ import annotations

import argparse
import importlib.util
from collections.abc import Callable
from importlib.machinery import ModuleSpec
from pathlib import Path

import grimp
import pytest

from walltopo.cli import build_parser, main

OPTIONAL = {"matplotlib", "onnx", "onnxscript", "optuna", "skimage", "sklearn", "torch"}
# Every command that wants something, in a use of it that wants most; nothing they name exists.
USES = {
    "evaluate scan s --truth t": {"sklearn"},
    "evaluate detector d --truth t -o o": {"matplotlib"},
    "dataset stats d -o o.png": {"matplotlib"},
    "dataset convert d o --to coco --refine sam": {"ultralytics"},
    "dataset project m -o o --refine sam": {"ultralytics"},
    "synth g": {"skimage"},
    "train d -o o": {"torch", "onnx", "onnxscript", "matplotlib"},
    "train d -o o --model yolo11s-seg": {"ultralytics", "torch", "onnx", "matplotlib"},
    "train classifier s -o o.onnx --label colour": {"torch", "onnx"},
    "train hold-types -o o.onnx": {"torch", "onnx", "skimage"},
    "train two-colours f -o o.onnx": {"torch", "onnx", "skimage"},
    "train paint f": {"sklearn", "skimage"},
    "tune lift w -o o": {"optuna", "torch", "matplotlib"},
    "tune routes w -o o": {"optuna", "torch", "matplotlib", "sklearn"},
    "tune detector d -o o": {"optuna", "torch", "onnx", "matplotlib"},
}


@pytest.fixture
def lacking(monkeypatch: pytest.MonkeyPatch) -> Callable[[set[str]], None]:
    """Called with modules: from then on they cannot be found."""
    find = importlib.util.find_spec

    def without(names: set[str]) -> None:
        def look(name: str, package: str | None = None) -> ModuleSpec | None:
            return None if name in names else find(name, package)

        monkeypatch.setattr(importlib.util, "find_spec", look)

    return without


@pytest.mark.parametrize(("use", "modules"), USES.items())
def test_it_is_reported_first(
    use: str,
    modules: set[str],
    lacking: Callable[[set[str]], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    lacking({"ultralytics"} - modules)  # what else is not here does not matter
    for module in sorted(modules):
        lacking({module, "ultralytics"} if "ultralytics" in modules else {module})
        assert main(use.split()) == 5
        output = " ".join(capsys.readouterr().err.split())
        assert module in output
        assert "pip install 'walltopo-lab" in output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "use",
    ["evaluate detector d --truth t", "dataset stats d", "dataset convert d o --to coco"],
)
def test_what_is_not_needed_is_not_requested(
    use: str,
    lacking: Callable[[set[str]], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    lacking({*OPTIONAL, "ultralytics"})
    assert main(use.split()) == 3  # goes on: no such data set


@pytest.mark.parametrize("command", ["evaluate", "dataset", "synth", "train", "tune"])
def test_no_command_reaches_a_library_that_it_does_not_ask_for(command: str) -> None:
    """A new import, however deep, must be declared."""
    graph = grimp.build_graph(
        "walltopo", "walltopo_lab", include_external_packages=True, cache_dir=None
    )
    reached = OPTIONAL & graph.find_upstream_modules(f"walltopo_lab.cli.{command}")
    requests = {m for use, names in USES.items() if use.split()[0] == command for m in names}
    assert reached <= requests


def test_every_use_is_one_of_the_parsers() -> None:
    parser = build_parser()
    for use in USES:
        args: argparse.Namespace = parser.parse_args(use.split())
        assert USES[use] <= set(args.needs(args))
