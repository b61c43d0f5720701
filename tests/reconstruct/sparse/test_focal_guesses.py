"""Photos without EXIF: several focal lengths are tried, and absurd lenses refused."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from walltopo.reconstruct.sparse.colmap_worker import _guess_focals, register_images
from walltopo.reconstruct.sparse.focal_guesses import (
    FOCALS,
    Mapped,
    best_mapping,
    focals_of,
    has_doubtful_lens,
)
from walltopo.reconstruct.sparse.jobs import (
    CameraEntry,
    ColmapJob,
    ImageEntry,
    MappingResult,
    Sift,
)

KNOWN = CameraEntry("SIMPLE_RADIAL", 640, 480, (500.0, 320.0, 240.0, 0.0), prior=True)
UNKNOWN = CameraEntry("SIMPLE_RADIAL", 480, 640, (480.0, 240.0, 320.0, 0.0), prior=False)


def job_of(database: Path, *cameras: CameraEntry) -> ColmapJob:
    images = tuple(ImageEntry(f"{k}.jpg", k) for k in range(len(cameras)))
    return ColmapJob(
        database=str(database),
        image_root="",
        threads=1,
        seed=0,
        sift=Sift(100, 0),
        min_matches=15,
        cameras=cameras,
        images=images,
    )


def mapped(registered: int, observations: int) -> Mapped:
    return Mapped(
        MappingResult(), dict.fromkeys(map(str, range(registered)), np.zeros(3)), observations
    )


@pytest.mark.parametrize(
    ("outcomes", "best", "tried"),
    [
        ([(6, 90), (6, 99)], 0.75, 1),
        ([(2, 74), (5, 313), (5, 390), (3, 176)], 0.55, 4),
        ([(0, 0), (0, 0), (0, 0), (0, 0)], 0.75, 4),
    ],
)
def test_the_first_complete_mapping_counts_else_the_one_of_most_observations(
    outcomes: list[tuple[int, int]], best: float, tried: int
) -> None:
    guesses: list[float] = []

    def map_from(focal: float) -> Mapped:
        guesses.append(focal)
        return mapped(*outcomes[len(guesses) - 1])

    found, focal = best_mapping(map_from, FOCALS, 6)
    assert (focal, guesses) == (best, list(FOCALS[:tried]))
    assert found.observations == outcomes[FOCALS.index(best)][1]


def test_only_unknown_lenses_are_guessed(tmp_path: Path) -> None:
    from walltopo.geometry.colmap import pycolmap

    assert focals_of(job_of(tmp_path, KNOWN)) == (0.0,)
    job = job_of(tmp_path / "f.db", KNOWN, UNKNOWN)
    assert focals_of(job) == FOCALS
    register_images(Path(job.database), job.cameras, job.images)
    for share in (1.4, 0.55):
        _guess_focals(Path(job.database), job, share)
        with pycolmap.Database.open(job.database) as db:
            assert list(db.read_camera(1).params) == [500, 320, 240, 0]
            assert np.allclose(db.read_camera(2).params, [share * 640, 240, 320, 0])


@dataclass
class Model:
    cameras: dict[int, object]
    registered: int = 3

    def num_reg_images(self) -> int:
        return self.registered


@pytest.mark.parametrize(
    ("focal", "distortion", "absurd"),
    [
        (480, 0.03, False),
        (250, -0.3, False),
        (3000, 0.0, False),
        (4000, 0.0, True),
        (100, 0.0, True),
        (500, 5.1, True),
        (2000, -4.2, True),
    ],
)
def test_an_absurd_lens_is_noticed(
    focal: float, distortion: float, absurd: bool, tmp_path: Path
) -> None:
    from walltopo.geometry.colmap import pycolmap

    camera = pycolmap.Camera(
        model="SIMPLE_RADIAL", width=480, height=640, params=[focal, 240, 320, distortion]
    )
    model = Model({2: camera})
    assert has_doubtful_lens(model, job_of(tmp_path, KNOWN, UNKNOWN)) == absurd
    assert not has_doubtful_lens(model, job_of(tmp_path, KNOWN, KNOWN)), (
        "a focal length of EXIF counts"
    )


@pytest.mark.parametrize(
    ("photos", "registered", "doubtful"), [(2, 2, False), (5, 2, True), (5, 3, False)]
)
def test_two_photos_of_more_tell_no_lens(
    photos: int, registered: int, doubtful: bool, tmp_path: Path
) -> None:
    from walltopo.geometry.colmap import pycolmap

    camera = pycolmap.Camera(
        model="SIMPLE_RADIAL", width=480, height=640, params=[480, 240, 320, 0.0]
    )
    model = Model({1: camera}, registered)
    assert has_doubtful_lens(model, job_of(tmp_path, *[UNKNOWN] * photos)) == doubtful
    assert not has_doubtful_lens(model, job_of(tmp_path, *[KNOWN] * photos))
