"""A rendered clip is read back: film, camera, body, contacts, command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from walltopo.cli import main
from walltopo.core import Camera, InputError
from walltopo.core.files import read_json
from walltopo.scans.attempt import AttemptFile
from walltopo_climb.movement.body import BODIES
from walltopo_lab.synth.clip import Passer
from walltopo_lab.synth.film import film_gym
from walltopo_lab.synth.filmed import read_clips
from walltopo_lab.synth.mannequin import draw_body, draw_clothes, parts_of, skeleton_of
from walltopo_lab.synth.path import look_at
from walltopo_lab.synth.small import write_tiny_gym

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
def test_a_filmed_climb_is_read_by_the_commands(tiny_scan: Path, tmp_path: Path) -> None:
    gym, clips, attempt = write_tiny_gym(tmp_path / "gym"), tmp_path / "clips", tmp_path / "a.json"
    [(video, truth)] = film_gym(gym, clips, 1, size=(540, 960))
    assert main(["beta", str(video), "--scan", str(tiny_scan), "-o", str(attempt)]) == 0
    read = AttemptFile.load(attempt)
    assert read.clip == "0.mp4"
    assert read.length == pytest.approx(truth.length, abs=0.3)
    assert len([one for one in read.contacts if one.limb.endswith("hand")]) >= 2
    assert all(0 <= one.begin <= one.end <= read.length + 0.2 for one in read.contacts)
    assert [move.time for move in read.moves] == sorted(move.time for move in read.moves)
    figures = tmp_path / "figures.json"
    arguments = ["--scan", str(tiny_scan), "--truth", str(gym), "-o", str(figures)]
    assert main(["evaluate", "beta", str(clips), *arguments]) == 0
    found = read_json(figures)
    assert (found["clips"], found["read"]) == (1, 1)
    assert found["camera_median_px"] < 5
    assert found["hands"]["true"] == sum(one.limb < 2 for one in truth.contacts)
    # How well clips are read is measured on many (docs/clips.md); one clip has few contacts.
    assert found["hands"]["recall"] > 0.1


def test_somebody_who_walks_by_is_drawn_before_the_climber_and_moves_on() -> None:
    passer = Passer(BODIES["adult"], draw_clothes(np.random.default_rng(0)), np.zeros(3), SIDE, 2.0)
    limbs, hips = passer.limbs_at(2.0)
    later, hips_later = passer.limbs_at(3.0)
    assert hips_later[0] - hips[0] == pytest.approx(1.2)
    assert (limbs[2:, 2] >= 0).all()
    assert (later[2:, 2] >= 0).all()
    legs = np.linalg.norm(limbs[2:] - hips, axis=1) / BODIES["adult"].leg
    assert ((legs > 0.8) & (legs < 1.05)).all()


def test_clips_without_their_truth_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no clips here"):
        read_clips(tmp_path)
    (tmp_path / "0.mp4").touch()
    with pytest.raises(InputError, match=r"0\.json"):
        read_clips(tmp_path)
