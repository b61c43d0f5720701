"""A body's square, the detector's boxes, and the points of a pose."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from climb.tests.beta.bodies import FixedSession
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.people import Person
from walltopo_climb.beta import pose
from walltopo_climb.beta.pose import (
    Body,
    Pose,
    PoseNetworks,
    Region,
    anchors,
    check_frame,
    decode,
    distinct,
    refined,
    shipped_networks,
)

ANGLES = np.radians([0, 30, -75, 90, 180, 200])


def blob(middle: tuple[float, float], shape: tuple[int, int] = (240, 320)) -> NDArray[np.uint8]:
    """Return a picture of a soft bright spot, whose middle is in continuous pixels."""
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    away = ((x - middle[0]) ** 2 + (y - middle[1]) ** 2) / (2 * 6.0**2)
    return np.repeat((250 * np.exp(-away))[..., None], 3, axis=2).astype(np.uint8)


def centroid(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the (x, y) of a picture's light, continuous pixels."""
    light = picture[..., 0].astype(float)
    y, x = np.mgrid[: light.shape[0], : light.shape[1]] + 0.5
    return np.array([(light * x).sum(), (light * y).sum()]) / light.sum()


def drawn_figure() -> NDArray[np.uint8]:
    """Return a picture of a stick figure on a wall of holds."""
    picture = np.full((360, 270, 3), 190, np.uint8)
    for x, y in np.random.default_rng(0).integers(0, 270, (30, 2)).tolist():
        cv2.circle(picture, (x, y), 8, (x % 255, y % 255, 60), -1)
    cv2.circle(picture, (135, 90), 16, (220, 170, 140), -1)
    cv2.rectangle(picture, (112, 108), (158, 190), (20, 40, 120), -1)
    for ends in (
        (112, 112, 80, 60),
        (158, 112, 190, 70),
        (122, 190, 100, 280),
        (148, 190, 180, 270),
    ):
        cv2.line(picture, ends[:2], ends[2:], (40, 40, 40), 14)
    return picture


def test_the_square_of_an_upright_body_is_upright() -> None:
    around = Region.around(np.array([100.0, 200.0]), np.array([100.0, 150.0]))
    assert (around.x, around.y, around.size) == (100, 200, 125)  # 1.25 x 2 x 50
    assert around.angle == pytest.approx(0)


def test_the_square_turns_with_the_body() -> None:
    leaning_right = Region.around(np.zeros(2), np.array([50.0, 0.0]))
    assert leaning_right.angle == pytest.approx(np.pi / 2)
    # The top of the square is on the right in the frame.
    assert leaning_right.to_frame(np.array([[0.5, 0.0]]))[0] == pytest.approx([62.5, 0])


@pytest.mark.parametrize("angle", ANGLES)
def test_places_in_the_square_and_in_the_frame_agree(angle: float) -> None:
    region = Region(120.5, 80.25, 150.0, float(angle))
    points = np.random.default_rng(1).uniform(0, 300, (50, 2))
    assert region.to_frame(region.to_square(points)) == pytest.approx(points, abs=1e-9)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_spot_lies_in_the_cut_where_the_square_says(angle: float) -> None:
    spot = (171.3, 118.6)
    region = Region(160.0, 125.0, 130.0, float(angle))
    cut = region.cut(blob(spot), 256)
    expected = region.to_square(np.array([spot]))[0] * 256
    assert centroid(cut) == pytest.approx(expected, abs=0.1)
    assert region.to_frame(centroid(cut)[None] / 256)[0] == pytest.approx(spot, abs=0.05)


def test_a_cut_repeats_the_edge_of_the_frame() -> None:
    frame = np.full((50, 40, 3), 77, np.uint8)
    assert (Region(0.0, 0.0, 200.0, 0.4).cut(frame, 64) == 77).all()


def test_anchors_are_those_of_a_literal_loop() -> None:
    expected = []
    for stride, count in ((8, 2), (16, 2), (32, 6)):
        cells = 224 // stride
        for y in range(cells):
            for x in range(cells):
                expected += [((x + 0.5) / cells, (y + 0.5) / cells)] * count
    assert anchors().shape == (2254, 2)
    assert anchors() == pytest.approx(np.array(expected))


def test_boxes_are_those_of_a_literal_loop() -> None:
    rng = np.random.default_rng(2)
    raw = rng.normal(0, 40, (2254, 12)).astype(np.float32)
    logits = rng.normal(-4, 3, 2254).astype(np.float32)
    rows, scores = decode(raw, logits)
    expected = []
    for k, (x, y) in enumerate(anchors()):
        score = 1 / (1 + np.exp(-float(logits[k])))
        if score >= 0.5:
            numbers = [float(value) / 224 for value in raw[k]]
            for j in range(12):
                if j not in (2, 3):
                    numbers[j] += (x, y)[j % 2]
            expected.append([*numbers, score])
    assert len(expected) > 50
    assert np.column_stack([rows, scores]) == pytest.approx(np.array(expected))


def test_scores_beyond_all_bounds_do_not_overflow() -> None:
    logits = np.full(2254, -1e4, np.float32)
    logits[7] = 1e4
    _, scores = decode(np.zeros((2254, 12), np.float32), logits)
    assert scores.tolist() == [1.0]


def test_boxes_of_one_body_become_their_weighted_mean() -> None:
    rows = np.zeros((3, 12))
    rows[:, :4] = [[0.5, 0.5, 0.2, 0.2], [0.51, 0.5, 0.2, 0.2], [0.1, 0.1, 0.1, 0.1]]
    rows[:, 4] = [0.5, 0.6, 0.1]
    found = distinct(rows, np.array([0.6, 0.9, 0.7]))
    assert [score for _, score in found] == [0.9, 0.7]
    assert found[0][0][4] == pytest.approx((0.5 * 0.6 + 0.6 * 0.9) / 1.5)
    assert found[1][0] == pytest.approx(rows[2])
    assert distinct(np.zeros((0, 12)), np.zeros(0)) == []


def test_heat_refines_points_as_a_literal_loop_does() -> None:
    rng = np.random.default_rng(3)
    places = rng.uniform(-0.1, 1.1, (39, 2))
    heatmaps = rng.normal(-3, 2, (39, 64, 64))
    heatmaps[5:12] = -9.0  # no heat: these points stay
    expected = places.copy()
    for k, (x, y) in enumerate(places):
        if not (0 <= x < 1 and 0 <= y < 1):
            continue
        total, across, down, most = 0.0, 0.0, 0.0, 0.0
        for row in range(int(y * 64) - 3, int(y * 64) + 4):
            for column in range(int(x * 64) - 3, int(x * 64) + 4):
                if 0 <= row < 64 and 0 <= column < 64:
                    heat = 1 / (1 + np.exp(-heatmaps[k, row, column]))
                    total, most = total + heat, max(most, heat)
                    across, down = across + heat * column, down + heat * row
        if most >= 0.5:
            expected[k] = across / 64 / total, down / 64 / total
    assert (expected != places).any(axis=1).sum() > 10
    assert refined(places, heatmaps) == pytest.approx(expected)


def test_bodies_are_found_in_pixels_of_a_wide_frame() -> None:
    boxes = np.zeros((1, 2254, 12), np.float32)
    scores = np.full((1, 2254, 1), -20, np.float32)
    number = 500
    scores[0, number] = 3
    middle = anchors()[number] * 224
    boxes[0, number, 4:8] = [*(112 - middle), *(112 - middle - (0, 28))]
    detector = FixedSession({"boxes": boxes, "scores": scores})
    networks = PoseNetworks(detector, FixedSession({}))
    (body,) = networks.detect(np.full((300, 600, 3), 255, np.uint8))
    assert body.score == pytest.approx(1 / (1 + np.exp(-3)))
    assert (body.region.x, body.region.y) == pytest.approx((300, 150))
    assert body.region.size == pytest.approx(2.5 * 28 * 600 / 224)
    assert body.region.angle == pytest.approx(0, abs=1e-6)
    # The frame fills the middle; black stripes are above and below it.
    assert (detector.pictures[0, :, 112] == 1).all()
    assert (detector.pictures[0, :, [0, 223]] == -1).all()


def test_people_are_found_by_their_boxes_and_aligned_by_the_detector(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    people = [Person((100.0, 40.0, 140.0, 120.0), 0.8), Person((220.0, 60.0, 280.0, 100.0), 0.6)]
    monkeypatch.setattr(pose, "find_people", lambda _: people)
    turned = Body(Region(50.0, 45.0, 90.0, 0.5), 0.9)

    class Aligned(PoseNetworks):
        def detect(self, frame: NDArray[np.uint8]) -> list[Body]:
            """Return a body in the first person's surroundings, 104 pixels a side."""
            return [turned] if frame.shape == (104, 104, 3) else []

    nothing = FixedSession({})
    found = Aligned(nothing, nothing).find_bodies(np.zeros((200, 300, 3), np.uint8))
    assert found == [
        Body(Region(68.0 + 50, 28.0 + 45, 90.0, 0.5), 0.8),
        Body(Region(250.0, 80.0, 78.0, 0.0), 0.6),
    ]


def test_without_people_clear_poses_are_searched_in_parts_of_the_frame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pose, "find_people", lambda _: [])
    climber, holds = np.array([150.0, 420.0]), np.array([60.0, 100.0])

    class Parts(PoseNetworks):
        def detect(self, frame: NDArray[np.uint8]) -> list[Body]:
            """Return the marks in a part of the frame: its values are numbers of pixels."""
            corner = frame[0, 0, :2].astype(int) * 2
            size = np.array(frame.shape[1::-1])
            inside = [
                m - corner
                for m in (climber, holds)
                if (abs(m - corner - size / 2) < size / 2).all()
            ]
            return [Body(Region(float(m[0]), float(m[1]), 80.0, 0.0), 0.9) for m in inside]

        def read_pose(self, frame: NDArray[np.uint8], region: Region) -> Pose:
            near = np.hypot(*(region.centre - climber)) < 2
            return Pose(np.zeros((33, 2)), np.ones(33), 1.0, region, 0.7 if near else 0.5)

    y, x = np.mgrid[:480, :240] // 2
    frame = np.stack([x, y, x], axis=-1).astype(np.uint8)
    nothing = FixedSession({})
    (found,) = Parts(nothing, nothing).find_bodies(frame)
    assert found.region.centre == pytest.approx(climber, abs=1)
    assert found.score == 0.7


def test_a_pose_is_mapped_back_into_the_frame() -> None:
    rows = np.zeros((39, 5), np.float32)
    rows[:, :2] = np.random.default_rng(4).uniform(20, 236, (39, 2))
    rows[:, 3:] = [2.0, -1.0]
    outputs = {
        "points": rows.reshape(1, 195),
        "presence": np.array([[0.75]], np.float32),
        "heatmaps": np.full((1, 39, 64, 64), -9, np.float32),
    }
    networks = PoseNetworks(FixedSession({}), FixedSession(outputs))
    region = Region(200.0, 100.0, 160.0, 0.7)
    found = networks.read_pose(np.zeros((240, 320, 3), np.uint8), region)
    assert region.to_square(found.points) * 256 == pytest.approx(rows[:33, :2], abs=1e-4)
    expected = 1 / (1 + np.exp(-2)) / (1 + np.exp(1))
    assert found.confidence == pytest.approx(np.full(33, expected))
    assert found.score == 0.75
    assert found.heat == pytest.approx(1 / (1 + np.exp(9)))
    hips, scale_point = region.to_frame(rows[33:35, :2].astype(float) / 256)
    assert found.region == Region.around(hips, scale_point)


def test_the_shipped_networks_answer_the_same_each_time() -> None:
    networks, picture = shipped_networks(), drawn_figure()
    assert networks.find_bodies(picture) == networks.find_bodies(picture)
    assert networks.detect(picture) == networks.detect(picture)
    region = Region(135.0, 190.0, 330.0, 0.1)
    found, again = (networks.read_pose(picture, region) for _ in range(2))
    assert found.points.shape == (33, 2)
    assert found.confidence.shape == (33,)
    assert ((found.confidence >= 0) & (found.confidence <= 1)).all()
    assert 0 <= found.score <= 1
    assert (found.points == again.points).all()
    assert found.region == again.region


def test_a_plain_wall_has_no_body() -> None:
    networks, wall = shipped_networks(), np.full((300, 200, 3), 180, np.uint8)
    assert networks.find_bodies(wall) == []
    assert networks.detect(wall) == []
    for x in (100.0, -900.0):
        found = networks.read_pose(wall, Region(x, 150.0, 150.0, 0.0))
        assert not found.is_clear
        assert not networks.shows_body(wall, found)
    assert networks.read_pose(wall, Region(100.0, 150.0, 150.0, 0.0)).score < 0.5


@pytest.mark.parametrize(
    "frame",
    [
        None,
        np.zeros((4, 4), np.uint8),
        np.zeros((4, 4, 4), np.uint8),
        np.zeros((0, 4, 3), np.uint8),
        np.zeros((4, 4, 3), np.float32),
    ],
)
def test_frames_that_are_not_pictures_are_refused(frame: object) -> None:
    with pytest.raises(InputError, match="frame 7: expected"):
        check_frame(frame, 7)
