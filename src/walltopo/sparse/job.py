"""What the child process that calls COLMAP is told, and what it answers."""

from __future__ import annotations

import msgspec

__all__ = [
    "CameraEntry",
    "ImageEntry",
    "Job",
    "KnownFeatures",
    "Learned",
    "MapTask",
    "Mapped",
    "Pairing",
    "Sift",
]


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
