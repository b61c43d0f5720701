"""People in photos: how many are found, what is masked wrongly, and what a scan loses by them.

    python -m benchmarks.people DATA OUT

People are cut out of eight photos of DATA/hold-boxes/train ("Climbing Holds and Volumes" by
Blackcreed, CC BY 4.0; none of it is stored outside of OUT) and pasted into others of that folder,
and into the photos of a generated gym, which is scanned without people, with people, and with
people who are not hidden. Files that OUT has already are kept. The photos of
hold-boxes/valid that show people were noted by eye (`people.json`).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Silent
from walltopo.geometry.mesh_files import read_mesh
from walltopo.images.files import read_rgb
from walltopo.images.people import find_people, people_mask
from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings
from walltopo.reconstruct.settings import TextureSettings
from walltopo.reconstruct.texture.atlas import make_texture
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import PhotoSet
from walltopo_lab.evaluate.scan import evaluate_scan
from walltopo_lab.evaluate.truth import read_truth
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate

Image = NDArray[np.uint8]
Bitmap = NDArray[np.bool_]
Cutout = tuple[Image, NDArray[np.float32]]  # colours, cover

RECIPE = Recipe(
    GymSettings(width=3.6, height=3.0, columns=3, facets=0.5, volumes=2, routes=5),
    PhotoSettings(photos=18, width=960, height=720),
    seed=83,
)
_SHARE = 0.5  # of the generated photos that show people, more than the 28 % of a gym's photos
_HEIGHTS = (40, 60, 90, 140, 220, 350)  # pixels, in photos of 1280 px
_BACKGROUNDS = 30
_LONG_SIDE = 1280
_SIDES = (_LONG_SIDE, 480, 320)  # of real photos, pixels
_TIMED = 12  # photos without people of a folder, at most
_SEED = 11
# Photos, and boxes x0, y0, x1, y1 of one person in each, chosen by eye.
_PEOPLE = (
    ("2022-12-07_17-47-58_UTC.jpg", (238, 382, 357, 643)),
    ("2022-12-09_08-49-34_UTC.jpg", (124, 244, 304, 534)),
    ("2022-12-11_10-26-02_UTC.jpg", (207, 368, 344, 637)),
    ("2022-12-07_15-01-30_UTC.jpg", (335, 330, 473, 605)),
    ("2022-12-08_14-10-23_UTC.jpg", (66, 78, 428, 509)),
    ("IMG_0380.jpg", (239, 818, 527, 1296)),
    ("2022-12-11_13-43-57_UTC.jpg", (280, 405, 372, 638)),
    ("2022-12-10_01-51-24_UTC.jpg", (489, 281, 591, 460)),
)


def cut_out(photo: Image, box: tuple[int, int, int, int]) -> Cutout:
    """Return the largest connected foreground of GrabCut in a box."""
    x0, y0, x1, y1 = box
    margin = 20
    top, left = max(0, y0 - margin), max(0, x0 - margin)
    crop = np.ascontiguousarray(photo[top : y1 + margin, left : x1 + margin])
    labels = np.full(crop.shape[:2], cv2.GC_BGD, dtype=np.uint8)
    labels[y0 - top : y1 - top, x0 - left : x1 - left] = cv2.GC_PR_FGD
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.setRNGSeed(0)
    cv2.grabCut(crop, labels, (0, 0, 1, 1), *models, 6, cv2.GC_INIT_WITH_MASK)
    _, parts, sizes, _ = cv2.connectedComponentsWithStats((labels & 1).astype(np.uint8))
    found = parts == 1 + int(np.asarray(sizes)[1:, cv2.CC_STAT_AREA].argmax())
    rows, columns = np.nonzero(found)
    window = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    return crop[window], found[window].astype(np.float32)


def paste(photo: Image, person: Cutout, height: int, rng: np.random.Generator) -> Bitmap:
    """Paste a person of a height at a random place of a photo, in place; return the pixels."""
    colours, cover = person
    width = max(1, round(colours.shape[1] * height / colours.shape[0]))
    small = cv2.resize(colours, (width, height), interpolation=cv2.INTER_AREA)
    share = np.asarray(cv2.resize(cover, (width, height), interpolation=cv2.INTER_AREA))[..., None]
    x = int(rng.integers(0, photo.shape[1] - width))
    y = int(rng.integers(0, photo.shape[0] - height))
    window = photo[y : y + height, x : x + width]
    window[:] = (window * (1 - share) + small * share).astype(np.uint8)
    truth = np.zeros(photo.shape[:2], dtype=np.bool_)
    truth[y : y + height, x : x + width] = share[..., 0] > 0.5
    return truth


def print_recall(people: Sequence[Cutout], photos: Sequence[Image]) -> None:
    """Print which people are found, and how much of those found is covered."""
    rng = np.random.default_rng(_SEED)
    for height in _HEIGHTS:
        found, covered, beyond = [], [], []
        for photo in photos:
            picture = photo.copy()
            if height >= photo.shape[0] // 2:
                continue
            truth = paste(picture, people[int(rng.integers(len(people)))], height, rng)
            mask = people_mask(picture, find_people(picture))
            share = float((mask & truth).sum() / truth.sum())
            found.append(share > 0.5)
            if share > 0.5:
                covered.append(share)
                beyond.append(float(mask.sum() / truth.sum()))
        print(
            f"people of {height} px: {np.mean(found):.3f} of {len(found)} found, "
            f"{np.mean(covered):.3f} of their pixels covered, "
            f"mask {np.median(beyond):.1f} times the person"
        )


def print_false(name: str, folder: Path) -> None:
    """Print in how many photos of a folder without people some are found, and the seconds of one."""
    photos = sorted(file for file in folder.iterdir() if file.suffix == ".jpg")[:_TIMED]
    seconds, found = [], 0
    for file in photos:
        photo = read_rgb(file)
        begin = time.process_time()
        found += bool(find_people(photo))
        seconds.append(time.process_time() - begin)
    print(
        f"{name}: people found in {found} of {len(photos)} photos, "
        f"{np.median(seconds):.3f} CPU-s a photo, mean {np.mean(seconds):.3f}"
    )


def print_real(folder: Path) -> None:
    """Print in how many photos that show people, and that show none, some are found."""
    listed = json.loads(files(__package__).joinpath("people.json").read_text(encoding="utf-8"))
    photos = [file for file in sorted(folder.iterdir()) if file.name not in listed["unclear"]]
    shown = np.array([file.name in listed["shown"] for file in photos])
    found = np.array([_found_in_sizes(read_rgb(file)) for file in photos])
    for side, one in zip(_SIDES, found.T, strict=True):
        print(
            f"hold-boxes/valid in {side} px: people found in {one[shown].sum()} of {shown.sum()} photos "
            f"that show some, in {one[~shown].sum()} of {(~shown).sum()} that show none"
        )


def _found_in_sizes(photo: Image) -> list[bool]:
    """Return for each of `_SIDES` whether people are found in a photo reduced to it."""
    found = []
    for side in _SIDES:
        factor = min(1.0, side / max(photo.shape[:2]))
        small = cv2.resize(photo, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        found.append(bool(find_people(np.asarray(small, dtype=np.uint8))))
    return found


def write_with_people(source: Path, target: Path, people: Sequence[Cutout]) -> dict[str, Bitmap]:
    """Write the photos, people in every second one; return the pixels of people by photo."""
    rng = np.random.default_rng(_SEED)
    target.mkdir(exist_ok=True)
    truth: dict[str, Bitmap] = {}
    for file in sorted(source.iterdir()):
        photo = read_rgb(file)
        if rng.random() < _SHARE:
            truth[file.name] = np.zeros(photo.shape[:2], dtype=np.bool_)
            for _ in range(int(rng.integers(1, 3))):
                height = int(rng.integers(120, 360))
                person = people[int(rng.integers(len(people)))]
                truth[file.name] |= paste(photo, person, height, rng)
        cv2.imwrite(str(target / file.name), photo[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 92])
    return truth


def print_scans(people: Sequence[Cutout], out: Path) -> None:
    """Print what the scans of a generated gym with and without people say."""
    generate(out / "gym", RECIPE)
    shown = write_with_people(out / "gym/photos", out / "people", people)
    runs = (
        ("without people", "gym/photos", "true"),
        ("people hidden", "people", "true"),
        ("people not hidden", "people", "false"),
    )
    truth = read_truth(out / "gym/truth")
    for name, photos, hide in runs:
        folder = out / name.replace(" ", "-")
        settings = load_settings(None, [f"ingest.hide_people={hide}"])
        scan(out / photos, folder, settings, to_stage="propose")
        figures = evaluate_scan(ScanFolder(folder), truth, similarity=False).figures
        print(f"{name}: {_summary(figures)}")
    _print_masks(PhotoSet(out / "people-hidden/photos"), shown)
    for name in ("people-hidden", "people-not-hidden"):
        print(f"{name}: {_painted(ScanFolder(out / name), shown):.4f} of the texture shows people")


def _summary(figures: dict[str, Any]) -> str:
    mesh, instances = figures["mesh"], figures["instances"]["agnostic"]
    return (
        f"mesh within 8 mm {mesh['accuracy_8mm']:.3f}, complete {mesh['completeness_10mm']:.3f}, "
        f"median {mesh['accuracy_median_mm']:.2f} mm; instances AP {instances['ap']:.3f}, AP50 {instances['ap50']:.3f}"
    )


def _painted(folder: ScanFolder, shown: dict[str, Bitmap]) -> float:
    """Return the share of a scan's painted surface whose photo shows a person there."""
    mesh, views, photos = read_mesh(folder.mesh), read_views(folder.sparse), PhotoSet(folder.photos)
    label = make_texture(
        mesh, views, photos.read_rgb, TextureSettings(), Silent(), photos.people_mask
    ).label
    on_people = 0.0
    for k, view in enumerate(views):
        if view.name in shown:
            faces = np.flatnonzero(label == k)
            at = view.camera.project(view.to_camera(mesh.centroids[faces])).astype(np.int64)
            on_people += mesh.areas[faces[shown[view.name][at[:, 1], at[:, 0]]]].sum()
    return float(on_people / mesh.areas[label >= 0].sum())


def _print_masks(photos: PhotoSet, shown: dict[str, Bitmap]) -> None:
    """Print how much of the pasted people is masked in the scan."""
    hit = total = 0
    for name, truth in shown.items():
        mask = photos.people_mask(name)
        total += int(truth.sum())
        hit += 0 if mask is None else int((mask & truth).sum())
    false = [e.photo for e in photos.people.photos if e.photo not in shown]
    print(
        f"people pasted into {len(shown)} photos: {hit / total:.3f} of their pixels hidden; "
        f"photos without people that were masked: {len(false)}"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    args = parser.parse_args(arguments)
    args.out.mkdir(parents=True, exist_ok=True)
    cv2.setNumThreads(1)
    train = args.data / "hold-boxes/train/images"
    people = [cut_out(read_rgb(train / name), box) for name, box in _PEOPLE]
    print_recall(people, backgrounds(train))
    print_false("generated gym-a", args.data / "gym-a/photos")
    print_false("spraywall", args.data / "spraywall/photos")
    print_real(args.data / "hold-boxes/valid/images")
    print_scans(people, args.out)


def backgrounds(folder: Path) -> list[Image]:
    """Return photos of `_LONG_SIDE` in which nobody is found, spread over a folder."""
    chosen: list[Image] = []
    photos = sorted(folder.iterdir())
    for file in photos[:: max(1, len(photos) // (2 * _BACKGROUNDS))]:
        photo = read_rgb(file)
        factor = _LONG_SIDE / max(photo.shape[:2])
        if factor > 1.6:
            continue
        photo = np.asarray(cv2.resize(photo, None, fx=factor, fy=factor), dtype=np.uint8)
        if len(chosen) < _BACKGROUNDS and not find_people(photo):
            chosen.append(photo)
    return chosen


if __name__ == "__main__":
    main()
