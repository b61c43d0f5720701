"""Define COLMAP's jobs and run them in a child process."""

from __future__ import annotations

import json
import re
import subprocess
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec.structs import replace

from walltopo.core import Progress, StageError
from walltopo.core.children import child_process, python_module
from walltopo.core.parallel import library_threads
from walltopo.reconstruct.settings import SparseSettings
from walltopo.scans.photos import Photo, PhotoSet


class CameraEntry(msgspec.Struct, frozen=True):
    """A camera of the database; the k-th has id k + 1.

    Parameters
    ----------
    model, params : COLMAP's camera model and parameters.
    width, height : pixels.
    prior : whether the focal length is known from EXIF or from a finished model.
    """

    model: str
    width: int
    height: int
    params: tuple[float, ...]
    prior: bool


class ImageEntry(msgspec.Struct, frozen=True):
    """A photo of the database; the k-th has id k + 1. `camera` is the index of its
    `CameraEntry`."""

    name: str
    camera: int


class Pairing(msgspec.Struct, frozen=True):
    """The rules that choose which photos are matched (see `pairs.choose_pairs`).

    Parameters
    ----------
    new, reference : image ids.
    exhaustive_max, sequential, retrieved, reference_retrieved : as in `SparseSettings`.
    """

    new: tuple[int, ...]
    reference: tuple[int, ...]
    exhaustive_max: int
    sequential: int
    retrieved: int
    reference_retrieved: int


# On the tiny gym, correct poses with a phone's noise explain 99 % of the matches, and poses of
# other photos 16 %.
MIN_EXPLAINED = 0.5


class MapTask(msgspec.Struct, frozen=True):
    """The input of a mapping.

    Parameters
    ----------
    output : folder for the models.
    expected : number of photos that may register, for the progress display.
    reference : folder of the model to continue; "" starts a new model.
    constant_cameras, held_images : ids in the reference whose intrinsics and poses stay fixed.
    only : names of the photos to map; empty: all.
    posed : folder of a model of given poses without points, where the mapping starts; "": none.
    focal : focal length of cameras that lack one, as a share of the longer side; 0: unchanged.
    min_explained : smallest share of the matches of posed photos that must become points.
    tentative : whether few points suffice to register a photo; the caller checks the model.
    """

    output: str
    expected: int
    reference: str = ""
    constant_cameras: tuple[int, ...] = ()
    held_images: tuple[int, ...] = ()
    only: tuple[str, ...] = ()
    posed: str = ""
    focal: float = 0.0
    min_explained: float = MIN_EXPLAINED
    tentative: bool = False


class Sift(msgspec.Struct, frozen=True):
    """The settings of SIFT.

    Parameters
    ----------
    max_features : maximum number of features per photo.
    first_octave : first octave; -1 doubles the photo's size.
    """

    max_features: int
    first_octave: int


class LearnedTask(msgspec.Struct, frozen=True):
    """The photos that get learned features (see `learned_features`).

    Parameters
    ----------
    images : image ids, ascending.
    points : maximum number of features per photo.
    partners : number of photos that each one is matched with.
    larger : whether the larger networks find and match them (see `larger_network`).
    """

    images: tuple[int, ...]
    points: int
    partners: int
    larger: bool = False


class KnownFeatures(msgspec.Struct, frozen=True):
    """Features of an earlier run.

    Parameters
    ----------
    database : path of the earlier database.
    names : maps image names of this job to image names in the earlier database.
    matches : whether the verified matches among these photos are reused too.
    """

    database: str
    names: dict[str, str]
    matches: bool = False


class ColmapJob(msgspec.Struct, frozen=True):
    """One run of the child process: features and matches, a mapping, or both.

    Parameters
    ----------
    database : path of COLMAP's database.
    image_root : folder of the photos.
    threads : number of CPU threads; -1 = all.
    masks : folder of masks, `<image name>.png`, that are black where no feature counts; "": none.
        The photos determine them, so they are no part of the cache key.
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
    learned: LearnedTask | None = None
    masks: str = ""


class MappingResult(msgspec.Struct, frozen=True):
    """The result of a mapping.

    Parameters
    ----------
    models : the size of each model.
    best : folder of the best model, or "".
    contradicts : the given poses contradict the photos, so there is no model.
    """

    models: dict[str, int] = {}
    best: str = ""
    contradicts: bool = False


# Focal length without EXIF, as a share of the longer side: 26 mm on 35 mm film (by the diagonal, as
# phones say it), which their main cameras have within 2 mm. COLMAP's default is 1.2, about 42 mm.
DEFAULT_FOCAL = 0.75


def photo_ids(photos: Sequence[Photo]) -> tuple[int, ...]:
    """Return the image ids of a scan's own photos, which come first in the database."""
    return tuple(range(1, len(photos) + 1))


def camera_entries(photos: Sequence[Photo]) -> tuple[list[CameraEntry], list[int]]:
    """Return one SIMPLE_RADIAL camera per (size, focal prior), and each photo's camera index."""
    keys: dict[tuple[int, int, float | None], int] = {}
    indices = [
        keys.setdefault((photo.width, photo.height, photo.focal_px), len(keys)) for photo in photos
    ]
    cameras = [
        CameraEntry(
            "SIMPLE_RADIAL",
            width,
            height,
            (focal or DEFAULT_FOCAL * max(width, height), width / 2, height / 2, 0.0),
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
) -> ColmapJob:
    """Return the job that finds and matches features.

    Parameters
    ----------
    new, reference : image ids of the scan's own photos and of the reference's.
    """
    return ColmapJob(
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


def write_masks(photos: Mapping[str, PhotoSet], folder: Path) -> str:
    """Write the masks of a `ColmapJob` that leave out people; return the folder, "" without any.

    Parameters
    ----------
    photos : maps the folder in an image's name, "" for none, to the photos.
    folder : new folder.
    """
    import cv2

    written = 0
    for prefix, chosen in photos.items():
        for entry in chosen.people.photos:
            mask = chosen.people_mask(entry.photo)
            assert mask is not None  # it has an entry
            path = folder / prefix / f"{entry.photo}.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(path), np.where(mask, 0, 255).astype(np.uint8))
            written += 1
    return str(folder) if written else ""


def mapping_job(job: ColmapJob, task: MapTask) -> ColmapJob:
    """Return a job that only maps the features and matches of another job."""
    return replace(job, pairing=None, learned=None, known_features=None, map=task)


_EVENT = "@walltopo "
_STEP_NAMES = {
    "features": "find features",
    "matches": "match photos",
    "turns": "find photos that are turned",
    "learned": "find features with a network",
    "learned matches": "match photos with a network",
    "poses": "triangulate in the given poses",
    "register": "register photos",
    "refine": "refine the model",
}
_FEATURE = re.compile(r"Processed file \[\d+/\d+\]")
_BLOCK = re.compile(r"\] Processing block \[")
_BLOCK_DONE = re.compile(r"\] in [\d.]+s")
_REGISTER = re.compile(r"Registering (initial image pair|image) #\d+")
_GLOG = re.compile(r"^[IWEF]\d{8} [\d:.]+ +\d+ [\w.]+:\d+\] ?")


def run_worker(job: ColmapJob, progress: Progress) -> MappingResult:
    """Run one job of `colmap_worker`; return the mapping's result, empty without a mapping.

    Raises
    ------
    StageError : COLMAP failed or crashed; the message holds the last lines of its log.
    """
    # COLMAP has its own threads, and a multi-threaded BLAS would change the last bits.
    environment = {"PYTHONUNBUFFERED": "1", **library_threads(job.threads, blas=1)}
    listener = _Listener(progress)
    with child_process(
        python_module("walltopo.reconstruct.sparse.colmap_worker"),
        msgspec.json.encode(job) + b"\n",
        environment=environment,
        errors=subprocess.STDOUT,
    ) as child:
        for line in child.output:
            listener.handle_line(line.decode("utf-8", "replace").rstrip("\n"))
        code = child.wait()
    listener.check(code)
    return msgspec.convert(listener.result, MappingResult)


class _Listener:
    """Converts the child's output lines to progress."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.result: dict[str, Any] = {}
        self.error = ""
        self._tail: deque[str] = deque(maxlen=8)
        self._step = ""
        self._remaining = 0
        self._block = 0

    def handle_line(self, line: str) -> None:
        """Handle one output line: an event or a line of COLMAP's log."""
        if line.startswith(_EVENT):
            self._event(json.loads(line[len(_EVENT) :]))
            return
        text = _GLOG.sub("", line).strip()
        if not text:
            return
        self._tail.append(text)
        self.progress.detail(f"colmap: {text}")
        if self._step == "features" and _FEATURE.search(text):
            self._advance(1)
        elif self._step == "matches" and _BLOCK_DONE.search(line):
            self._advance(self._block)
        elif self._step == "register" and (found := _REGISTER.search(text)):
            self._advance(2 if found.group(1).startswith("initial") else 1)

    def check(self, code: int) -> None:
        if code == 0 and not self.error:
            return
        last_lines = self.error or "\n".join(self._tail)
        ended = f"ended by signal {-code}" if code < 0 else f"failed (exit code {code})"
        raise StageError(
            f"COLMAP {ended} during the step "
            f"'{_STEP_NAMES.get(self._step, 'start')}':\n{last_lines}",
            "Run again with -v to see its whole log.",
        )

    def _event(self, event: dict[str, Any]) -> None:
        if "step" in event:
            self._step = event["step"]
            self._remaining = event["total"]
            self._block = event.get("block", 1)
            if self._remaining:
                self.progress.step(_STEP_NAMES[self._step], self._remaining)
        elif "advance" in event:
            self._advance(event["advance"])
        elif "error" in event:
            self.error = event["error"]
        else:
            if self._step == "refine":
                self._advance(1)
            self.result.update(event)

    def _advance(self, count: int) -> None:
        # COLMAP logs attempts, not successes; never advance beyond the announced total.
        count = min(count, self._remaining)
        self._remaining -= count
        if count:
            self.progress.advance(count)
