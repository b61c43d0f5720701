"""The search: it finds, resumes, refuses to mix, and says what it was tuned on."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.cli import tune as commands
from walltopo.core import Camera, InputError, Mesh, SettingsError, View
from walltopo.settings import load_settings
from walltopo.tune.problem import Range
from walltopo.tune.report import merge_settings, write_report, write_slices
from walltopo.tune.study import open_study, results, search
from walltopo.tune.walls import read_walls

pytest.importorskip("optuna")
pytest.importorskip("torch")


class Hill:
    """A hill at a = .7; b does nothing, and above .9 it is impossible."""

    section, figure = "routes", "height"
    fixed: Mapping[str, Any] = {}
    ranges: Sequence[Range] = (Range("a", 0, 1, 0.1), Range("b", 0, 1, 0.5, curve=2.0))

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        if values["b"] > 0.9:
            raise SettingsError("b is too large")
        return {"one": 1 - (values["a"] - 0.7) ** 2, "two": 1 - abs(values["a"] - 0.7)}


def test_search_finds_resumes_and_explains(tmp_path: Path) -> None:
    storage, hill = f"sqlite:///{tmp_path / 's.db'}", Hill()
    search(open_study(hill, storage, "hill", 0), hill, 12)
    again = open_study(hill, storage, "hill", 1)
    assert len(again.trials) == 12
    search(again, hill, 18)
    search(again, hill, 18)  # all done: nothing happens
    found = results(again, hill)
    assert len(found.trials) == 18
    assert found.trials[0].values == pytest.approx({"a": 0.1, "b": 0.5})
    assert found.default.figure == pytest.approx((1 - 0.36 + 1 - 0.6) / 2)
    assert abs(found.best.values["a"] - 0.7) < 0.05
    assert found.importance["a"] > found.importance["b"]
    write_report(tmp_path / "r.md", hill, found, None)
    assert "very walls that were tuned on" in (tmp_path / "r.md").read_text().replace("\n", " ")
    write_report(tmp_path / "r.md", hill, found, {"far": (0.5, 0.6)})
    assert "| far | 0.500 | 0.600 |" in (tmp_path / "r.md").read_text()
    write_slices(tmp_path / "s.png", hill, found)
    assert (tmp_path / "s.png").stat().st_size > 2000


@given(
    low=st.floats(-5, 5), width=st.floats(0.1, 100), share=st.floats(0, 1),
    curve=st.sampled_from([1.0, 2.0, 3.0]),
)  # fmt: skip
def test_ranges_and_shares_are_inverse(
    low: float, width: float, share: float, curve: float
) -> None:
    r = Range("x", low, low + width, low, curve)
    assert low - 1e-9 <= r.value(share) <= low + width + 1e-9
    assert r.value(r.share(r.value(share))) == pytest.approx(r.value(share), abs=1e-6)
    assert r.value(r.share(low)) == low


def test_another_search_in_the_same_study_is_refused(tmp_path: Path) -> None:
    storage, hill = f"sqlite:///{tmp_path / 's.db'}", Hill()
    open_study(hill, storage, "hill", 0)
    other = Hill()
    other.figure = "depth"
    with pytest.raises(InputError, match="searches something else"):
        open_study(other, storage, "hill", 0)
    with pytest.raises(InputError, match="cannot be opened"):
        open_study(hill, f"sqlite:///{tmp_path}/none/s.db", "hill", 0)


def walls_file(folder: Path, *rows: str) -> Path:
    (folder / "t").mkdir(exist_ok=True)
    (folder / "u").mkdir(exist_ok=True)
    path = folder / "walls.toml"
    path.write_text("\n".join(f"[[wall]]\n{row}" for row in rows))
    return path


def test_walls_are_read(tmp_path: Path) -> None:
    path = walls_file(
        tmp_path, 'name = "a"\nuse = "train"\ntruth = "t"', 'name = "b"\nuse = "test"\ntruth = "u"'
    )
    assert [(w.name, w.use) for w in read_walls(path)] == [("a", "train"), ("b", "test")]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (
            ['name="a"\nuse="train"\ntruth="t"', 'name="a"\nuse="test"\ntruth="u"'],
            "a would be tuned",
        ),
        (
            ['name="a"\nuse="train"\ntruth="t"', 'name="b"\nuse="test"\ntruth="t"'],
            "is the truth of",
        ),
        (['name="a"\nuse="test"\ntruth="t"'], "no wall to tune on"),
        (['name="a"\nuse="both"\ntruth="t"'], "expected train or test"),
        (['name="a"\nuse="train"\ntruth="z"'], "does not exist"),
        (['name="a"\nuse="train"'], "lacks truth"),
        (['name="a"\nuse="train"\ntruth="t"\nmeshes="m"'], "unknown keys"),
        ([], "no .*wall.* tables"),
    ],
)
def test_walls_that_would_mislead_are_refused(
    tmp_path: Path, rows: list[str], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_walls(walls_file(tmp_path, *rows))


def test_settings_file_keeps_other_sections(tmp_path: Path) -> None:
    path = tmp_path / "walltopo.toml"
    path.write_text('[routes]\nmin_holds = 3\nresolution = 1.0\n[detect]\nmodel = "best \\"x\\""\n')
    merge_settings(path, "routes", {"resolution": 2.5})
    merge_settings(path, "lift", {"method": "literal", "threshold": 0.25})
    settings = load_settings(path)
    assert (settings.routes.min_holds, settings.routes.resolution) == (3, 2.5)
    assert (settings.lift.method, settings.lift.threshold) == ("literal", 0.25)
    assert 'best \\"x\\"' in path.read_text()


def grid(n: int) -> Mesh:
    """A 2 m square wall in the plane y = 0."""
    x, z = np.meshgrid(np.linspace(0, 2, n + 1), np.linspace(0, 2, n + 1))
    vertices = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + 1, corner + n + 2, corner + n + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Mesh(vertices, faces.astype(np.int32))


def boxes(mesh: Mesh) -> NDArray[np.int32]:
    """Eight square holds: two columns of four, 1.2 m apart."""
    x, _, z = mesh.centroids.T
    face_instance = np.zeros(len(mesh.faces), dtype=np.int32)
    for k in range(8):
        cx, cz = 0.4 + 1.2 * (k // 4), 0.3 + 0.45 * (k % 4)
        face_instance[(abs(x - cx) < 0.08) & (abs(z - cz) < 0.08)] = k + 1
    return face_instance


def make_gym(folder: Path) -> None:
    """Truth, cameras and masks of a tiny wall, as a generator would write them."""
    from walltopo.datasets.project import masks_of_view
    from walltopo.formats.coco import write_coco_masks

    mesh = grid(40)
    face_instance = boxes(mesh)
    folder.mkdir(parents=True)
    views = np.full(len(mesh.faces), 4, np.int32)
    np.savez(
        folder / "gt.npz", vertices=mesh.vertices, faces=mesh.faces, face_instance=face_instance,
        face_views=views,
    )  # fmt: skip
    rows = [
        {
            "id": k + 1, "class": "hold", "kind": "jug", "colour": "red", "route": k // 4,
            "position": [0.4 + 1.2 * (k // 4), 0.0, 0.3 + 0.45 * (k % 4)], "normal": [0, -1, 0],
        }
        for k in range(8)
    ]  # fmt: skip
    (folder / "scene.json").write_text(json.dumps({"instances": rows}))
    camera = Camera("PINHOLE", 160, 160, (120.0, 120.0, 80.0, 80.0))
    rotation = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    masks, sizes, lines = {}, {}, []
    for k in range(4):
        centre = np.array([0.7 + 0.2 * k, -1.8, 1.0])
        view = View(f"{k}.jpg", camera, np.column_stack([rotation, -rotation @ centre]))
        labels = dict.fromkeys(range(1, 9), 1)
        masks[view.name] = [m for _, m in masks_of_view(mesh, face_instance, labels, view)]
        sizes[view.name] = (160, 160)
        shift = -rotation @ centre
        # A quarter turn about x: quaternion (cos 45, sin 45, 0, 0).
        lines += [
            f"{k + 1} 0.70710678118 0.70710678118 0 0 {shift[0]} {shift[1]} {shift[2]} 1 {k}.jpg",
            "",
        ]
    write_coco_masks(folder / "masks.json", masks, sizes, {1: "hold", 2: "volume"})
    (folder / "cameras").mkdir()
    (folder / "cameras/cameras.txt").write_text("1 PINHOLE 160 160 120 120 80 80\n")
    (folder / "cameras/images.txt").write_text("\n".join(lines) + "\n")
    (folder / "cameras/points3D.txt").write_text("")


@pytest.fixture
def two_gyms(tmp_path: Path) -> Path:
    make_gym(tmp_path / "t")
    make_gym(tmp_path / "u")
    return walls_file(
        tmp_path, 'name="a"\nuse="train"\ntruth="t"', 'name="b"\nuse="test"\ntruth="u"'
    )


def run_command(*words: str) -> int:
    parser = argparse.ArgumentParser()
    commands.register(parser.add_subparsers())
    args = parser.parse_args(["tune", *words])
    return int(args.run(args))


@pytest.mark.parametrize("what", ["lift", "routes"])
def test_tune_command(tmp_path: Path, two_gyms: Path, what: str) -> None:
    out = tmp_path / "out"
    assert run_command(what, str(two_gyms), "-o", str(out), "--trials", "3") == 0
    settings = load_settings(out / "walltopo.toml")
    assert 0 <= settings.lift.threshold <= 1
    report = (out / "report.md").read_text()
    assert "On walls that were not tuned on" in report
    assert "| b |" in report
    assert (out / "slices.png").is_file()


@pytest.mark.parametrize(("distance", "power"), [(8.0, 0.0), (2.0, 0.5), (2.1, -0.8)])
def test_seen_once_gives_what_a_fresh_look_gives(
    tmp_path: Path, distance: float, power: float
) -> None:
    from walltopo.core import Silent
    from walltopo.lift.blocks import blocks_of
    from walltopo.lift.evidence import Sampling, gather_evidence
    from walltopo.lift.fast import by_score
    from walltopo.tune.lift_problem import load_lift_wall
    from walltopo.tune.seen import SeenOnce
    from walltopo.tune.walls import Wall

    make_gym(tmp_path / "t")
    wall = load_lift_wall(Wall("a", "train", tmp_path / "t"))
    sampling = Sampling(distance, power)
    fresh = gather_evidence(blocks_of(wall.mesh), wall.views, by_score, sampling, Silent())
    cached = SeenOnce(wall.mesh, wall.views, 20.0).evidence(distance, power)
    for name in ("faces", "starts", "projection", "view", "first_mask", "label"):
        assert (getattr(fresh, name) == getattr(cached, name)).all(), name
    assert cached.ease == pytest.approx(fresh.ease, abs=1e-4)
