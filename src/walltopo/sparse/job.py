"""What the child process that calls COLMAP is told, and what it answers."""

from __future__ import annotations

import msgspec

__all__ = ["CameraEntry", "ImageEntry", "Job", "KnownFeatures", "MapTask", "Mapped", "Pairing"]


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


class KnownFeatures(msgspec.Struct, frozen=True):
    """Features that another scan found: its database, and a photo's name there by its name here."""

    database: str
    names: dict[str, str]


class Job(msgspec.Struct, frozen=True):
    """One run of the child: features and matches (`pairing`), or a mapping (`map`), or both.

    Parameters
    ----------
    database : file of the features; image_root : folder of the photos.
    threads : -1 = all.
    """

    database: str
    image_root: str
    threads: int
    seed: int
    max_features: int
    first_octave: int
    min_matches: int
    cameras: tuple[CameraEntry, ...]
    images: tuple[ImageEntry, ...]
    pairing: Pairing | None = None
    map: MapTask | None = None
    known_features: KnownFeatures | None = None


class Mapped(msgspec.Struct, frozen=True):
    """What a mapping gave: size of each model, and the folder of the best ("" where none)."""

    models: dict[str, int] = {}
    best: str = ""
