"""The measure on synthetic sightings: exact, noisy, and everything that is wrong with plates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from walltopo.core import Camera, StageError, View
from walltopo.geometry.similarity import Similarity, rotation_with_z
from walltopo.images.markers import Detection
from walltopo.reconstruct.scale.from_plates import frame_from_plates
from walltopo.reconstruct.scale.plates import Plate, built_in_plates, sticker

Floats = NDArray[np.float64]
CAMERA = Camera("SIMPLE_RADIAL", 1280, 960, (950.0, 640.0, 480.0, 0.035))
PLATES = built_in_plates()[:4]
PLACES = [(0.0, 0.0, 20.0), (3.0, -0.5, -5.0), (6.0, 0.3, 100.0), (9.0, 0.0, 0.0)]
# The model frame of every test: another unit, turned, shifted.
MODEL_FROM_WORLD = Similarity(
    0.4, Rotation.from_rotvec([0.4, -0.7, 1.9]).as_matrix(), np.array([1.0, -2.0, 0.5])
)
UP = MODEL_FROM_WORLD.rotation[:, 2]


def camera_at(eye: Floats, target: Floats, name: str) -> View:
    """A view in the model frame of a level camera that stands in the world at `eye`."""
    ahead = (target - eye) / np.linalg.norm(target - eye)
    rotation = rotation_with_z(ahead, np.cross(ahead, [0, 0, 1.0]))
    turned = rotation @ MODEL_FROM_WORLD.rotation.T
    return View(name, CAMERA, np.c_[turned, -turned @ MODEL_FROM_WORLD.apply(eye)])


def on_floor(plate: Plate, place: tuple[float, float, float]) -> Similarity:
    """World from plate for a plate at x, y turned by degrees, its board under the print."""
    x, y, turn = place
    rotation = Rotation.from_euler("z", turn, degrees=True).as_matrix()
    return Similarity(1.0, rotation, np.array([x, y, plate.thickness]))


def shoot(
    plates: Sequence[tuple[Plate, Similarity]],
    photos: int = 4,
    noise: float = 0.0,
    growth: float = 0.0,
) -> tuple[list[View], list[Detection]]:
    """`photos` views around each plate and the markers seen in them, larger than they are."""
    rng = np.random.default_rng(0)
    views: list[View] = []
    detections: list[Detection] = []
    for number, (_, world_from_plate) in enumerate(plates):
        centre = world_from_plate.translation
        for k, angle in enumerate(np.linspace(-2.2, -0.9, photos)):
            eye = centre + np.array([1.6 * np.cos(angle), 1.6 * np.sin(angle), 1.4])
            views.append(camera_at(eye, centre, f"{number}_{k}.jpg"))
    for view in views:
        for plate, world_from_plate in plates:
            for marker in plate.ids:
                world = world_from_plate.apply(plate.corners(marker, growth))
                pixels = view.project(MODEL_FROM_WORLD.apply(world))
                if ((pixels > 0) & (pixels < [1280, 960])).all():
                    pixels = pixels + rng.normal(0, noise, (4, 2))
                    detections.append(Detection(view.name, marker, pixels, plate.dictionary))
    return views, detections


def world_of(views: list[View], detections: list[Detection], **options: object) -> Similarity:
    measure, _, _ = frame_from_plates(views, detections, PLATES, UP, **options)  # type: ignore[arg-type]
    assert measure is not None
    return measure.world_from_model


@pytest.mark.parametrize("way", ["corners", "markers", "auto", "published"])
def test_exact_sightings_give_the_exact_world(way: str) -> None:
    views, seen = shoot([(p, on_floor(p, at)) for p, at in zip(PLATES[:2], PLACES, strict=False)])
    world = world_of(views, seen, way=way).after(MODEL_FROM_WORLD)
    # Only the heading differs: the world's x runs along the first plate's top edge.
    assert world.scale == pytest.approx(1, abs=1e-6)
    assert np.allclose(world.rotation[2], [0, 0, 1], atol=1e-6)
    assert np.allclose(world.translation, 0, atol=1e-5)
    heading = world.rotation @ Rotation.from_euler("z", 20, degrees=True).as_matrix()
    assert np.allclose(heading, np.eye(3), atol=1e-6)


@pytest.mark.parametrize("way", ["corners", "markers"])
@pytest.mark.parametrize("growth", [-0.01, 0.004])
def test_markers_that_look_larger_or_smaller_change_no_length(way: str, growth: float) -> None:
    """Ink spreads, and light areas grow over dark ones; the markers' distances stay."""
    views, seen = shoot([(PLATES[0], on_floor(PLATES[0], PLACES[0]))], growth=growth)
    _, (report,), _ = frame_from_plates(views, seen, PLATES, UP, way=way)
    assert report.residual_mm < 1e-3
    world = world_of(views, seen, way=way).after(MODEL_FROM_WORLD)
    assert world.scale == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("way", ["corners", "markers"])
def test_noise_of_a_fifth_of_a_pixel_stays_within_the_targets(way: str) -> None:
    placed = [(p, on_floor(p, at)) for p, at in zip(PLATES[:3], PLACES, strict=False)]
    views, seen = shoot(placed, photos=5, noise=0.2)
    world = world_of(views, seen, way=way).after(MODEL_FROM_WORLD)
    assert world.scale == pytest.approx(1, abs=1e-3)
    assert np.degrees(np.arccos(world.rotation[2, 2])) < 0.1
    assert abs(world.translation[2]) < 0.005


def test_the_published_way_is_not_polished() -> None:
    placed = [(p, on_floor(p, at)) for p, at in zip(PLATES[:3], PLACES, strict=False)]
    views, seen = shoot(placed, photos=5, noise=0.2)
    errors = {}
    for way in ("published", "markers"):
        _, reports, _ = frame_from_plates(views, seen, PLATES, UP, way=way)
        errors[way] = [report.residual_mm for report in reports]
        world = world_of(views, seen, way=way).after(MODEL_FROM_WORLD)
        assert world.scale == pytest.approx(1, abs=0.01)
    assert all(a < b for a, b in zip(errors["markers"], errors["published"], strict=True))


def test_each_plate_is_reported_with_its_place_in_the_world() -> None:
    places = [on_floor(plate, at) for plate, at in zip(PLATES[:2], PLACES, strict=False)]
    views, seen = shoot(list(zip(PLATES[:2], places, strict=True)))
    measure, reports, _ = frame_from_plates(views, seen, PLATES, UP)
    assert measure is not None
    for report, plate, place in zip(reports, PLATES[:2], places, strict=True):
        there = MODEL_FROM_WORLD.apply(place.apply(plate.outline))
        assert np.allclose(report.outline, there, atol=1e-5)


def test_a_false_detection_does_not_matter() -> None:
    views, seen = shoot([(PLATES[0], on_floor(PLATES[0], PLACES[0]))], photos=6)
    # Marker 2 at a wrong spot of one photo.
    bad = next(k for k, d in enumerate(seen) if d.marker == 2)
    seen[bad] = Detection(seen[bad].photo, 2, seen[bad].corners + np.array([150, 80]))
    world = world_of(views, seen).after(MODEL_FROM_WORLD)
    assert world.scale == pytest.approx(1, abs=2e-3)


def shrunk(plate: Plate, factor: float, at: tuple[float, float, float]) -> Similarity:
    """The plate printed at `factor` of its size."""
    placed = on_floor(plate, at)
    return Similarity(factor, placed.rotation, placed.translation)


def test_a_plate_printed_at_the_wrong_size_is_named_and_left_out() -> None:
    placed = [(p, on_floor(p, at)) for p, at in zip(PLATES[:3], PLACES, strict=False)]
    placed[1] = (PLATES[1], shrunk(PLATES[1], 0.94, PLACES[1]))
    views, seen = shoot(placed)
    measure, reports, notes = frame_from_plates(views, seen, PLATES, UP)
    assert measure is not None
    assert measure.world_from_model.after(MODEL_FROM_WORLD).scale == pytest.approx(1, abs=1e-4)
    assert [r.used for r in reports if r.label == "board 4-7"] == [False]
    assert any("board 4-7" in n and "0.940 times the size" in n for n in notes)


def test_two_plates_that_disagree_stop_the_scale() -> None:
    placed = [
        (PLATES[0], on_floor(PLATES[0], PLACES[0])),
        (PLATES[1], shrunk(PLATES[1], 0.94, PLACES[1])),
    ]
    views, seen = shoot(placed)
    with pytest.raises(StageError, match="disagree about the scale") as output:
        frame_from_plates(views, seen, PLATES, UP)
    assert "ignore_plates" in output.value.hint


def test_two_plates_with_the_same_ids_are_reported() -> None:
    twin = on_floor(PLATES[0], PLACES[1])
    views, seen = shoot([(PLATES[0], on_floor(PLATES[0], PLACES[0])), (PLATES[0], twin)])
    with pytest.raises(StageError, match="two plates carry the same ids"):
        frame_from_plates(views, seen, PLATES, UP)


def test_a_twin_is_left_out_where_another_plate_is_sound() -> None:
    placed = [(PLATES[0], on_floor(PLATES[0], PLACES[k])) for k in (0, 1)]
    placed.append((PLATES[2], on_floor(PLATES[2], PLACES[2])))
    views, seen = shoot(placed)
    measure, _, notes = frame_from_plates(views, seen, PLATES, UP)
    assert measure is not None
    assert measure.world_from_model.after(MODEL_FROM_WORLD).scale == pytest.approx(1, abs=1e-5)
    assert any("board 0-3" in note for note in notes)


def test_a_plate_in_one_photo_is_reported_and_gives_nothing() -> None:
    views, seen = shoot([(PLATES[0], on_floor(PLATES[0], PLACES[0]))])
    seen = [d for d in seen if d.photo == "0_1.jpg"]
    measure, reports, notes = frame_from_plates(views, seen, PLATES, UP)
    assert measure is None
    assert "one registered photo only (0_1.jpg)" in notes[0]
    assert [r.used for r in reports] == [False]


def test_a_plate_in_unregistered_photos_is_reported() -> None:
    views, seen = shoot([(PLATES[0], on_floor(PLATES[0], PLACES[0]))])
    _, _, notes = frame_from_plates(
        views[:1], [d for d in seen if d.photo != "0_0.jpg"], PLATES, UP
    )
    assert "not registered (0_1.jpg, 0_2.jpg, 0_3.jpg)" in notes[0]


def test_a_lone_marker_in_one_photo_is_a_false_alarm() -> None:
    views, seen = shoot([(PLATES[0], on_floor(PLATES[0], PLACES[0]))])
    measure, reports, notes = frame_from_plates(views, seen[:1], PLATES, UP)
    assert (measure, reports, notes) == (None, (), ())


def test_a_plate_of_another_shape_is_named_by_its_residual() -> None:
    wider = Plate("board", "DICT_4X4_50", (0, 1, 2, 3), (0.46, 0.42), 0.15, 0.02)
    views, seen = shoot([(wider, on_floor(wider, PLACES[0]))])
    measure, _, notes = frame_from_plates(views, seen, PLATES, UP, way="corners")
    assert measure is None
    assert "miss their places" in notes[0]


def test_a_plate_on_the_wall_gives_scale_but_no_floor() -> None:
    upright = Similarity(
        1.0, Rotation.from_euler("x", 90, degrees=True).as_matrix(), np.array([0, 0, 1.2])
    )
    views, seen = shoot([(PLATES[0], upright)])
    measure, _, notes = frame_from_plates(views, seen, PLATES, UP)
    assert measure is not None
    assert not measure.floor_known
    assert measure.world_from_model.after(MODEL_FROM_WORLD).scale == pytest.approx(1, abs=1e-5)
    assert any("no plate lies on the floor" in note for note in notes)


def test_an_uneven_floor_is_reported() -> None:
    placed = [(p, on_floor(p, at)) for p, at in zip(PLATES[:3], PLACES, strict=False)]
    raised = placed[1][1]
    lifted = Similarity(1.0, raised.rotation, raised.translation + np.array([0, 0, 0.12]))
    placed[1] = (PLATES[1], lifted)
    placed.append((PLATES[3], on_floor(PLATES[3], (4.0, 3.0, 0.0))))
    views, seen = shoot(placed)
    _, _, notes = frame_from_plates(views, seen, PLATES, UP)
    assert any("off the common floor" in note for note in notes)


def test_stickers_on_the_wall_give_the_scale_and_not_up() -> None:
    wall = Rotation.from_euler("x", 90, degrees=True).as_matrix()  # the prints face -y
    stickers = [
        (sticker(code), Similarity(1.0, wall, np.array([0.9 * code, 2.0, 1.0 + 0.3 * code])))
        for code in range(5)
    ]
    views, seen = shoot(stickers, photos=5, noise=0.1)
    plates = [plate for plate, _ in stickers]
    frame, reports, _ = frame_from_plates(views, seen, plates, UP, tolerance=0.05)
    assert frame is not None
    assert not frame.floor_known
    assert sum(report.used for report in reports) == 5
    assert frame.world_from_model.scale * MODEL_FROM_WORLD.scale == pytest.approx(1, abs=0.003)
