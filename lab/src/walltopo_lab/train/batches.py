"""Random batches of crops, produced by a thread in parallel with the training step."""

from __future__ import annotations

import hashlib
import queue
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo_lab.train.augment import Crop, crop_sample, mosaic
from walltopo_lab.train.cache import open_cache
from walltopo_lab.train.params import AugmentSettings, TrainSettings
from walltopo_lab.train.paste import paste_objects
from walltopo_lab.train.targets import Targets, make_targets

Batch = dict[str, NDArray[np.generic]]
Folders = Sequence[tuple[Path, Sequence[str]]]


@dataclass(frozen=True)
class CropSource:
    """Labelled photos, and how crops of them are drawn.

    Parameters
    ----------
    folders : cache folder and the names of its photos to sample, per set.
    shares : share of the crops from each set; the sum is 1.
    outlined : sets with exact outlines, whose objects are pasted onto other crops.
    """

    folders: Folders
    shares: Sequence[float]
    settings: TrainSettings
    augment: AugmentSettings
    outlined: Folders = ()

    def crop(self, rng: np.random.Generator) -> Crop:
        """Return a random crop."""
        return self._crop_of(self.folders, self.shares, rng)

    def outlined_crop(self, rng: np.random.Generator) -> Crop:
        """Return a random crop of the sets with exact outlines."""
        equal = [1 / len(self.outlined)] * len(self.outlined)
        return self._crop_of(self.outlined, equal, rng)

    def _crop_of(self, folders: Folders, shares: Sequence[float], rng: np.random.Generator) -> Crop:
        folder, names = folders[int(rng.choice(len(folders), p=shares))]
        sample = open_cache(folder, names[int(rng.integers(len(names)))])
        return crop_sample(sample, self.settings.crop, self.augment, rng)


def source_of(name: str) -> str:
    """Return the original photo of a file: Roboflow appends `.rf.<hash>` to augmented copies."""
    return name.split(".rf.")[0]


def split_sources(names: Sequence[str], held_out: float) -> tuple[list[str], list[str]]:
    """Split names into training and held-out ones; all copies of one source stay together.

    The side of a source depends on its name alone, so that added photos never change it. Sources
    with the same day in their name (one visit to one gym) also stay together.
    """
    train: list[str] = []
    kept: list[str] = []
    for name in names:
        source = source_of(name)
        key = source[:13] if source[:2] == "20" and source[4:5] == "-" else source
        digest = hashlib.blake2b(key.encode(), digest_size=4).digest()
        share = int.from_bytes(digest, "big") / 2**32
        (kept if share < held_out else train).append(name)
    return train, kept


def _one_batch(source: CropSource, rng: np.random.Generator) -> Batch:
    images: list[NDArray[np.uint8]] = []
    targets: list[Targets] = []
    for _ in range(source.settings.batch):
        count = 4 if rng.random() < source.augment.mosaic else 1
        crops = [source.crop(rng) for _ in range(count)]
        crop = mosaic(crops, rng) if count == 4 else crops[0]
        if source.outlined and rng.random() < source.augment.paste:
            other = source.outlined_crop(rng)
            crop = paste_objects(crop, other, int(rng.integers(1, 4)), rng)
        images.append(crop.image)
        targets.append(make_targets(crop))
    batch: Batch = {"image": np.stack(images).transpose(0, 3, 1, 2)}
    for field in fields(Targets):
        batch[field.name] = np.stack([getattr(t, field.name) for t in targets])
    return batch


def batches(source: CropSource, seed: int) -> Iterator[Batch]:
    """Yield batches without end."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng(seed)
    ready: queue.Queue[Batch | BaseException] = queue.Queue(maxsize=2)
    over = threading.Event()

    def produce() -> None:
        try:
            while not over.is_set():
                ready.put(_one_batch(source, rng))
        except BaseException as error:  # passed to the consumer, which raises it
            ready.put(error)

    worker = threading.Thread(target=produce, daemon=True)
    worker.start()
    try:
        while True:
            item = ready.get()
            if isinstance(item, BaseException):
                raise item
            yield item
    finally:
        over.set()
        while not ready.empty():
            ready.get_nowait()
