"""Backends: which is picked, what they say when they cannot run, how OpenMVS is driven."""

from __future__ import annotations

import argparse
import json
import stat
import sys
from pathlib import Path

import numpy as np
import pytest

from walltopo.cli import mesh as mesh_cli
from walltopo.core import EnvironmentLacksError, Mesh, SettingsError, Silent, StageError
from walltopo.dense import stage
from walltopo.dense.colmap import colmap_mesh
from walltopo.dense.contract import DenseSettings
from walltopo.dense.openmvs import (
    PROGRAMS,
    commands,
    find_programs,
    parse_progress,
    run_program,
)
from walltopo.meshes.ply import write_ply

FAKE = """#!{python}
import sys
print("16:20:31 [App     ] OpenMVS fake", flush=True)
print("\\rEstimated depth-maps 12 (16.67%, 3s, ETA 15s)", end="", flush=True)
print("\\rEstimated depth-maps 72 (100%, 18s)", flush=True)
sys.exit({code})
"""


class Recorder(Silent):
    def __init__(self) -> None:
        self.steps: list[str] = []
        self.done = 0

    def step(self, what: str, total: int | None = None) -> None:
        self.steps.append(what)

    def advance(self, count: int = 1) -> None:
        self.done += count


def fake_programs(folder: Path, code: int = 0, names: tuple[str, ...] = PROGRAMS) -> None:
    for name in names:
        path = folder / name
        path.write_text(FAKE.format(python=sys.executable, code=code))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)


def test_missing_programs_are_named(tmp_path: Path) -> None:
    fake_programs(tmp_path, names=PROGRAMS[:2])
    with pytest.raises(EnvironmentLacksError, match="ReconstructMesh, RefineMesh not found"):
        find_programs(str(tmp_path))


def test_argument_lists_chain_their_files(tmp_path: Path) -> None:
    fake_programs(tmp_path)
    steps = commands(find_programs(str(tmp_path)), Path("/w"), 1600)
    assert [Path(s[0]).name for s in steps] == list(PROGRAMS)
    assert steps[0][1:] == ["-i", ".", "-o", "scene.mvs", "--image-folder", "images", "-w", "/w"]
    assert steps[1][1:4] == ["scene.mvs", "-o", "scene_dense.mvs"]
    assert "--max-resolution" in steps[1]
    assert steps[2][1:4] == ["scene_dense.mvs", "-p", "scene_dense.ply"]
    assert steps[3][3:] == ["scene_mesh.ply", "-o", "scene_refined.ply", "-w", "/w"]


@pytest.mark.parametrize(
    ("line", "what", "percent"),
    [
        ("Estimated depth-maps 12 (16.67%, 3s, ETA 15s)", "Estimated depth-maps", 16.67),
        ("Fused depth-maps 72 (100%, 18s)", "Fused depth-maps", 100.0),
        ("16:20:31 [App     ] Command line: scene.mvs", None, 0.0),
    ],
)
def test_progress_lines(line: str, what: str | None, percent: float) -> None:
    step = parse_progress(line)
    assert (step.what if step else None) == what
    if step:
        assert step.percent == percent


def test_a_program_runs_with_progress_and_log(tmp_path: Path) -> None:
    fake_programs(tmp_path)
    recorder = Recorder()
    run_program([str(tmp_path / "DensifyPointCloud")], tmp_path, recorder)
    assert recorder.done == 100
    assert "Estimated" in (tmp_path / "DensifyPointCloud.log").read_text()


def test_a_failing_program_shows_its_last_words(tmp_path: Path) -> None:
    fake_programs(tmp_path, code=3)
    with pytest.raises(StageError, match=r"(?s)RefineMesh ended with code 3.*depth-maps 72"):
        run_program([str(tmp_path / "RefineMesh")], tmp_path, Silent())


def test_colmap_without_cuda_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("walltopo.dense.colmap.has_cuda", lambda: False)
    with pytest.raises(EnvironmentLacksError, match="needs a pycolmap with CUDA"):
        colmap_mesh(tmp_path, tmp_path, tmp_path, DenseSettings(), 0.01, 1.0, Silent())


def test_auto_picks_the_best_there_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage, "has_cuda", lambda: False)
    fake_programs(tmp_path)
    assert stage.pick_backend(DenseSettings(openmvs_bin=str(tmp_path)))[0] == "openmvs"
    assert stage.pick_backend(DenseSettings(openmvs_bin=str(tmp_path / "none")))[0] == "sgm"
    assert stage.pick_backend(DenseSettings(backend="sparse")) == ("sparse", "as asked")
    monkeypatch.setattr(stage, "has_cuda", lambda: True)
    assert stage.pick_backend(DenseSettings())[0] == "colmap"


def test_settings_are_bounded() -> None:
    with pytest.raises(SettingsError, match=r"dense\.backend: expected one of"):
        DenseSettings(backend="magic")  # type: ignore[arg-type]
    with pytest.raises(SettingsError, match=r"dense\.edge_length: expected at least"):
        DenseSettings(edge_length=0.0)


def check(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser()
    mesh_cli.register(parser.add_subparsers())
    args = parser.parse_args(["mesh", "check", *arguments])
    return int(args.run(args))


def test_mesh_check_tells_good_from_bad(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    good = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], dtype=np.int32)
    write_ply(tmp_path / "good.ply", Mesh(corners, good))
    bad = np.concatenate([good, [[0, 1, 2], [0, 1, 2]]]).astype(np.int32)
    write_ply(tmp_path / "bad.ply", Mesh(corners, bad))
    assert check([str(tmp_path / "good.ply")]) == 0
    assert check([str(tmp_path / "bad.ply")]) == 1
    assert "not manifold" in capsys.readouterr().out
    assert check([str(tmp_path / "good.ply"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["faces"] == 4
