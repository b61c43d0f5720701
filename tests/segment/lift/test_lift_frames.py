"""A mesh in another unit or with other axes than the cameras."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walltopo.cli import main
from walltopo.core import Mesh
from walltopo.geometry.mesh_files import read_mesh, write_ply
from walltopo.segment.lift_frames import MeshChange, explain_frames


def changed(mesh: Mesh, change: MeshChange) -> Mesh:
    """Return the mesh that the change brings back into the frame of the cameras."""
    return Mesh(mesh.vertices @ change.rotation / change.factor, mesh.faces)


def in_front(mesh: Mesh) -> Mesh:
    """Return the mesh of the scene, whose triangles are inside out, with its front outside."""
    return Mesh(mesh.vertices, np.ascontiguousarray(mesh.faces[:, ::-1]))


def test_a_mesh_in_the_frame_of_the_cameras_has_no_hint(three_bumps: Any) -> None:
    mesh, views = three_bumps[:2]
    assert explain_frames(in_front(mesh), views, 0) == ""
    assert "from behind" in explain_frames(mesh, views, 0)


@pytest.mark.parametrize("factor", [0.001, 1000.0, 0.0254, 100.0])
def test_the_factor_is_named(factor: float, three_bumps: Any) -> None:
    mesh, views = three_bumps[:2]
    change = MeshChange(factor)
    assert f"were {change.describe()}," in explain_frames(changed(mesh, change), views, 0)


@pytest.mark.parametrize("turn", [(0, 90), (0, -90), (1, 90)])
@pytest.mark.parametrize("factor", [1.0, 0.001])
def test_a_turn_that_fits_is_named(turn: tuple[int, int], factor: float, three_bumps: Any) -> None:
    """The scene is symmetric, so several turns may fit; the named one does."""
    mesh, views = three_bumps[:2]
    hint = explain_frames(changed(mesh, MeshChange(factor, *turn)), views, 0)
    assert re.search("if the mesh were turned by .*, (9[0-9]|100) % would", hint)
    assert ("scaled" in hint) == (factor != 1)


UTM = np.array([691_000.0, 5_335_000.0, 520.0])


def command(files: Path, *more: str) -> list[str]:
    """Return the arguments of a lift of the files."""
    given = ["--mesh", "mesh.ply", "--cameras", "transforms.json", "--masks", "ids", "-o", "out"]
    return ["lift", *(a if a.startswith("-") else str(files / a) for a in given), *more]


@pytest.mark.parametrize(
    "change", [MeshChange(0.001), MeshChange(1000.0), MeshChange(1.0, 0, 90), MeshChange(0.0254)]
)
def test_the_command_names_the_change(
    change: MeshChange, files: Path, three_bumps: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    write_ply(files / "mesh.ply", changed(three_bumps[0], change))
    code = main(command(files))
    text = " ".join("".join(capsys.readouterr()).split())
    assert "if the mesh were" in text
    assert code in (0, 3)
    # Instances in wrong places come with a warning, none with an error.
    assert ("warning: " in text) == (code == 0) == (files / "out" / "instances.json").is_file()


def test_mesh_and_cameras_in_utm_give_the_same_instances(files: Path, three_bumps: Any) -> None:
    mesh = three_bumps[0]
    assert main(command(files)) == 0
    shutil.move(files / "out", files / "local")
    write_ply(files / "mesh.ply", Mesh(mesh.vertices + UTM, mesh.faces))
    cameras = json.loads((files / "transforms.json").read_text())
    for frame in cameras["frames"]:
        for row, shift in zip(frame["transform_matrix"], UTM, strict=False):
            row[3] += shift
    (files / "transforms.json").write_text(json.dumps(cameras))
    assert main(command(files)) == 0
    labels = [np.load(files / name / "instances.npz")["face_instance"] for name in ("local", "out")]
    np.testing.assert_array_equal(*labels)
    for name, step in (("instances.ply", 1e-8), ("instances.glb", 1e-6)):
        found = read_mesh(files / "out" / name)
        corners = found.vertices[found.faces] - UTM
        np.testing.assert_allclose(corners, mesh.vertices[mesh.faces], atol=step)
