"""Jobs of the child process that calls COLMAP: its messages, and how jobs are made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
from msgspec.structs import replace

from walltopo.reconstruct.sparse.settings import SparseSettings
from walltopo.scans.photos import Photo


class CameraEntry(msgspec.Struct, frozen=True):
    """A camera of the database; the k-th gets id k + 1.

    Parameters
    ----------
    model, params : COLMAP's; width, height : pixels.
    prior : its focal length is known from EXIF or from a finished model.
    """

    model: str
    width: int
    height: int
    params: tuple[float, ...]
    prior: bool


class ImageEntry(msgspec.Struct, frozen=True):
    """A photo of the database; the k-th gets id k + 1. `camera` : index of its `CameraEntry`."""

    name: str
    camera: int


class Pairing(msgspec.Struct, frozen=True):
    """Which photos are matched; see `pairs.choose_pairs`.

    Parameters
    ----------
    new, reference : image ids.
    exhaustive_max, sequential, retrieved, reference_retrieved : of the settings.
    """

    new: tuple[int, ...]
    reference: tuple[int, ...]
    exhaustive_max: int
    sequential: int
    retrieved: int
    reference_retrieved: int


class MapTask(msgspec.Struct, frozen=True):
    """What is mapped.

    Parameters
    ----------
    output : folder for the models.
    expected : photos that may register, for the progress.
    reference : folder of a model that is continued; "".
    constant_cameras, held_images : ids that stay exactly as they are there.
    only : names of the photos that take part; all where empty.
    """

    output: str
    expected: int
    reference: str = ""
    constant_cameras: tuple[int, ...] = ()
    held_images: tuple[int, ...] = ()
    only: tuple[str, ...] = ()


class Sift(msgspec.Struct, frozen=True):
    """How SIFT looks.

    Parameters
    ----------
    max_features : most of one photo.
    first_octave : -1 doubles the photo first.
    """

    max_features: int
    first_octave: int


class Learned(msgspec.Struct, frozen=True):
    """Which photos get learned features too (`colmap_learned`).

    Parameters
    ----------
    images : image ids, ascending.
    points : most features of one photo.
    partners : how many of the others each is matched with.
    """

    images: tuple[int, ...]
    points: int
    partners: int


class KnownFeatures(msgspec.Struct, frozen=True):
    """Features that were found before.

    Parameters
    ----------
    database : of then.
    names : a photo's name there by its name here.
    matches : the verified matches among these photos are taken over as well.
    """

    database: str
    names: dict[str, str]
    matches: bool = False


class Job(msgspec.Struct, frozen=True):
    """One run of the child: features and matches (`pairing`, `learned`), or a mapping (`map`), or
    both.

    Parameters
    ----------
    database : file of the features; image_root : folder of the photos.
    threads : -1 = all.
    """

    database: str
    image_root: str
    threads: int
    seed: int
    sift: Sift
    min_matches: int
    cameras: tuple[CameraEntry, ...]
    images: tuple[ImageEntry, ...]
    pairing: Pairing | None = None
    map: MapTask | None = None
    known_features: KnownFeatures | None = None
    learned: Learned | None = None


class Mapped(msgspec.Struct, frozen=True):
    """What a mapping gave: size of each model, and the folder of the best ("" where none)."""

    models: dict[str, int] = {}
    best: str = ""


_DEFAULT_FOCAL = 1.2  # of the longer side, where EXIF tells none (COLMAP's own default)


def photo_ids(photos: Sequence[Photo]) -> tuple[int, ...]:
    """The image ids of a scan's own photos: they come first in the database."""
    return tuple(range(1, len(photos) + 1))


def camera_entries(photos: Sequence[Photo]) -> tuple[list[CameraEntry], list[int]]:
    """One SIMPLE_RADIAL camera per (size, focal prior), and each photo's index into them."""
    keys: dict[tuple[int, int, float | None], int] = {}
    indices = [
        keys.setdefault((photo.width, photo.height, photo.focal_px), len(keys)) for photo in photos
    ]
    cameras = [
        CameraEntry(
            "SIMPLE_RADIAL",
            width,
            height,
            (focal or _DEFAULT_FOCAL * max(width, height), width / 2, height / 2, 0.0),
            focal is not None,
        )
        for width, height, focal in keys
    ]
    return cameras, indices


def features_job(
    database: Path,
    image_root: Path,
    settings: SparseSettings,
    cameras: Sequence[CameraEntry],
    images: Sequence[ImageEntry],
    new: Sequence[int],
    reference: Sequence[int] = (),
) -> Job:
    """The job that finds and matches features.

    Parameters
    ----------
    new, reference : image ids of the scan's own photos and of the reference's.
    """
    return Job(
        database=str(database),
        image_root=str(image_root),
        threads=settings.threads or -1,
        seed=settings.seed,
        sift=Sift(settings.max_features, settings.first_octave),
        min_matches=settings.min_matches,
        cameras=tuple(cameras),
        images=tuple(images),
        pairing=Pairing(
            tuple(new),
            tuple(reference),
            settings.exhaustive_max,
            settings.sequential,
            settings.retrieved,
            settings.reference_retrieved,
        ),
    )


def mapping_job(job: Job, task: MapTask) -> Job:
    """The job that maps from what another has found and matched, and looks for nothing itself."""
    return replace(job, pairing=None, learned=None, known_features=None, map=task)
