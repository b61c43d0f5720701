"""A rendered clip is read back: film, camera, body, contacts, command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.contacts import wall_of

from walltopo.cli import main
from walltopo.core import Camera
from walltopo.scans.attempt import AttemptFile
from walltopo_climb.movement.body import BODIES
from walltopo_climb.movement.on_wall import climb_of, on_route
from walltopo_climb.movement.sequence import find_sequence
from walltopo_lab.synth.clip import Climber, Phone, film_climb, phone_path
from walltopo_lab.synth.develop import Exposure
from walltopo_lab.synth.gym import make_gym
from walltopo_lab.synth.mannequin import draw_body, draw_clothes, parts_of, skeleton_of
from walltopo_lab.synth.path import look_at
from walltopo_lab.synth.performance import perform
from walltopo_lab.synth.render import Renderer
from walltopo_lab.synth.small import tiny_recipe, write_tiny_gym

OUT = np.array([0.0, -1.0, 0.0])
SIDE = np.array([1.0, 0.0, 0.0])


def test_limbs_end_where_they_should_and_bones_keep_their_lengths() -> None:
    body = BODIES["adult"]
    limbs = np.array([[-0.3, 0, 2.0], [0.3, 0, 2.1], [-0.2, 0, 0.6], [0.25, 0, 0.7]])
    bones = skeleton_of(limbs, np.array([0.0, -0.35, 1.2]), body, OUT, SIDE)
    for left in (0, 1):
        upper = np.linalg.norm(bones.elbows[left] - bones.shoulders[left])
        lower = np.linalg.norm(bones.hands[left] - bones.elbows[left])
        assert upper == pytest.approx(lower)
        assert bones.shoulders[0][0] < bones.shoulders[1][0]
        assert (bones.feet[left] == limbs[2 + left]).all()
    assert bones.head[2] > bones.neck[2] > bones.hips[2]


def test_a_body_is_drawn_where_it_stands() -> None:
    body = BODIES["adult"]
    limbs = np.array([[-0.3, 0, 2.0], [0.3, 0, 2.1], [-0.2, 0, 0.6], [0.25, 0, 0.7]])
    bones = skeleton_of(limbs, np.array([0.0, -0.35, 1.2]), body, OUT, SIDE)
    clothes = draw_clothes(np.random.default_rng(0))
    parts, colours = parts_of(bones, body, clothes, OUT)
    camera = Camera("SIMPLE_PINHOLE", 120, 160, (150.0, 60.0, 80.0))
    pose = look_at(np.array([0.0, -4.0, 1.3]), np.array([0.0, 0.0, 1.3]), 0.0)
    picture = np.zeros((160, 120, 3), np.float32)
    drawn = draw_body(picture, camera, pose, parts, colours, 1.0)
    for point in (bones.head, bones.hips, *bones.hands, *bones.feet):
        x, y = camera.project(pose[:, :3] @ point + pose[:, 3])
        assert drawn[round(y) - 2 : round(y) + 3, round(x) - 2 : round(x) + 3].any()
    assert 300 < drawn.sum() < 2500
    assert (picture[~drawn] == 0).all()
    behind = look_at(np.array([0.0, -4.0, 1.3]), np.array([0.0, -8.0, 1.3]), 0.0)
    assert not draw_body(picture, camera, behind, parts, colours, 1.0).any()


@pytest.mark.slow
def test_a_filmed_climb_is_read_by_the_command(tiny_scan: Path, tmp_path: Path) -> None:
    gym_folder = write_tiny_gym(tmp_path / "gym")
    holds, routes, _ = wall_of(gym_folder)
    rng = np.random.default_rng(3)
    found = []
    for route in routes:
        climb = climb_of(route, on_route(route, holds, 1.0), 1.0)
        sequence = None if climb is None else find_sequence(climb, BODIES["adult"])
        if climb is not None and sequence is not None:
            found.append((climb, sequence))
    climb, sequence = max(found, key=lambda pair: len(pair[1].moves))
    performance = perform(climb, sequence, rng)
    recipe = tiny_recipe()
    renderer = Renderer(make_gym(recipe.gym, recipe.seed))
    out = climb.grips.wall.mean(axis=0)
    middle = performance.hips.mean(axis=0)
    eye = middle + 3.5 * out * [1, 1, 0] / np.linalg.norm(out[:2])
    poses = phone_path(eye, middle, len(performance.times), rng, handheld=False)
    camera = Camera("SIMPLE_PINHOLE", 540, 720, (650.0, 270.0, 360.0))
    phone = Phone(camera, poses, Exposure(1.0, (1.0, 1.0, 1.0), (0.0, 0.0), 0.005))
    climber = Climber(performance, BODIES["adult"], draw_clothes(rng), out)
    clip = tmp_path / "clip.mp4"
    film_climb(clip, renderer, climber, phone, rng)
    attempt = tmp_path / "attempt.json"
    assert main(["beta", str(clip), "--scan", str(tiny_scan), "-o", str(attempt)]) == 0
    read = AttemptFile.load(attempt)
    assert read.clip == "clip.mp4"
    assert read.length == pytest.approx(float(performance.times[-1]), abs=0.3)
    hands = [one for one in read.contacts if one.limb.endswith("hand")]
    assert len(hands) >= 2
    assert all(0 <= one.begin <= one.end <= read.length + 0.2 for one in read.contacts)
    assert [move.time for move in read.moves] == sorted(move.time for move in read.moves)
