"""Rendered clips of climbers on a generated gym, read against a scan of that gym.

    python -m benchmarks.clips SCAN GYM [--clips 8] [--out FOLDER]

SCAN is a scan of the photos of GYM, a folder of `walltopo synth` without scanned holds. A jointed
body with clothes climbs routes of the gym as the movement model climbs them, filmed by a phone that
stands, and in every third clip by one in a hand; every second climb ends in a fall. The clips are
read as videos are: camera, body and contacts are all found. Clips that are in FOLDER already are
not filmed again.
"""

from __future__ import annotations

import argparse
import pickle
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.contacts import Climbed, climbed, wall_of
from walltopo.core import Camera, InputError
from walltopo.geometry.similarity import Similarity
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.beta.clip import ClipReading, read_clip
from walltopo_climb.beta.scanned_wall import ScannedWall
from walltopo_climb.movement.body import BODIES
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.contacts import ContactCounts, count_contacts
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth
from walltopo_lab.synth.clip import Climber, Phone, film_climb, phone_path
from walltopo_lab.synth.develop import draw_exposure
from walltopo_lab.synth.gym import make_gym
from walltopo_lab.synth.mannequin import draw_clothes
from walltopo_lab.synth.params import PhotoSettings
from walltopo_lab.synth.recipe import read_recipe
from walltopo_lab.synth.render import Renderer

Floats = NDArray[np.float64]

SIZE = (720, 1280)  # of the clips
SAME_HOLD_M = 0.12  # between a hold of the scan and the true one


@dataclass(frozen=True, eq=False)
class Filmed:
    """A clip and its truth."""

    number: int
    video: Path
    route: int
    climbed: Climbed
    camera: Camera
    poses: Floats
    is_handheld: bool


def film(gym: Path, out: Path, count: int) -> Iterator[Filmed]:
    """Yield `count` clips of a gym's routes, filmed into a folder."""
    holds, routes, _ = wall_of(gym)
    recipe = read_recipe(gym)
    renderer: Renderer | None = None
    number, made = -1, 0
    while made < count and number < 8 * count:
        number += 1
        kept = out / f"{number}.pickle"
        if not kept.is_file():
            if renderer is None:
                renderer = Renderer(make_gym(recipe.gym, recipe.seed))
            clip = _film_one(number, renderer, routes, holds, recipe.photos, out)
            if clip is None:
                continue
            kept.write_bytes(pickle.dumps(clip))
        made += 1
        yield pickle.loads(kept.read_bytes())


def _film_one(
    number: int,
    renderer: Renderer,
    routes: Sequence[Route],
    holds: Sequence[Hold],
    photos: PhotoSettings,
    out: Path,
) -> Filmed | None:
    """Return a filmed climb, None if this body climbs fewer than three moves of the route."""
    rng = np.random.default_rng([renderer.gym.seed, number])
    route = routes[number % len(routes)]
    body = list(BODIES.values())[(number // len(routes) + number) % len(BODIES)]
    done = climbed(route, holds, body, rng, falls=bool(number % 2))
    if done is None:
        return None
    times = done.performance.times
    level = done.outward * [1, 1, 0] / np.linalg.norm(done.outward[:2])
    middle = done.performance.hips.mean(axis=0)
    eye = middle + rng.uniform(3.2, 5.0) * level
    eye += rng.uniform(-1.2, 1.2) * np.array([-level[1], level[0], 0])
    eye[2] = rng.uniform(1.2, 1.7)
    focal = float(rng.uniform(0.7, 0.9) * max(SIZE))
    handheld = number % 3 == 2
    phone = Phone(
        Camera("SIMPLE_PINHOLE", *SIZE, (focal, SIZE[0] / 2, SIZE[1] / 2)),
        phone_path(eye, middle, len(times), rng, handheld=handheld),
        draw_exposure(photos, renderer.gym.settings.light, rng),
    )
    video = out / f"{number}.mp4"
    climber = Climber(done.performance, body, draw_clothes(rng), done.outward)
    film_climb(video, renderer, climber, phone, rng, samples=1 if handheld else 2)
    return Filmed(number, video, route.id, done, phone.camera, phone.cam_from_world, handheld)


@dataclass(frozen=True, eq=False)
class Matches:
    """The scan's holds and routes as the gym's: by id, 0 and None for those that the gym lacks."""

    gym_from_scan: Similarity
    hold: Mapping[int, int]
    route: Mapping[int, int | None]
    places: Floats

    @classmethod
    def of(cls, scan: ScanFolder, wall: ScannedWall, gym: Path) -> Matches:
        """Match by place in the common frame of the photos."""
        exact = read_truth(gym)
        frame = align_views(scan_views(scan, exact), exact.views, similarity=True)
        holds, routes, _ = wall_of(gym)
        places = frame.apply(np.array([hold.position for hold in wall.holds]))
        true = np.array([hold.position for hold in holds])
        away = np.linalg.norm(places[:, None] - true[None], axis=2)
        nearest = away.argmin(axis=1)
        matched = {
            hold.id: holds[k].id if away[row, k] < SAME_HOLD_M else 0
            for row, (hold, k) in enumerate(zip(wall.holds, nearest.tolist(), strict=True))
        }
        of_routes: dict[int, int | None] = {}
        for route in wall.routes:
            counts = {
                one.id: sum(matched[hold] in one.holds for hold in route.holds) for one in routes
            }
            best = max(counts, key=lambda key: counts[key])
            of_routes[route.id] = best if counts[best] else None
        return cls(frame, matched, of_routes, places)


def camera_error(clip: Filmed, reading: ClipReading, wall: ScannedWall, truth: Matches) -> float:
    """Return the median distance of holds in the frames from their true places, pixels."""
    seen = np.array([hold.position for hold in wall.holds]) / wall.unit
    errors = []
    for frame, pose in enumerate(clip.poses):
        true = clip.camera.project(truth.places @ pose[:, :3].T + pose[:, 3])
        inside = ((true > 0) & (true < SIZE)).all(axis=1)
        found, _ = reading.frames.project(frame, seen)
        errors.extend(np.linalg.norm(true - found, axis=1)[inside].tolist())
    return float(np.median(errors))


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scan", type=Path)
    parser.add_argument("gym", type=Path)
    parser.add_argument("--clips", type=int, default=8)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args(arguments)
    scan = ScanFolder(args.scan)
    wall = ScannedWall.load(scan)
    truth = Matches.of(scan, wall, args.gym)
    hands, feet = ContactCounts(), ContactCounts()
    named = tops = wrong_tops = topped = read = 0
    with tempfile.TemporaryDirectory() as scratch:
        out = args.out or Path(scratch)
        out.mkdir(parents=True, exist_ok=True)
        for clip in film(args.gym, out, args.clips):
            begun, cpu = time.perf_counter(), time.process_time()
            try:
                reading = read_clip(clip.video, wall)
            except InputError as error:
                print(f"clip {clip.number}: {error}")
                continue
            took, spent = time.perf_counter() - begun, time.process_time() - cpu
            attempt = reading.attempt
            found = [replace(one, hold=truth.hold.get(one.hold, 0)) for one in attempt.contacts]
            own = ContactCounts(), ContactCounts()
            count_contacts(found, clip.climbed.contacts, *own)
            count_contacts(found, clip.climbed.contacts, hands, feet)
            route = None if attempt.route is None else truth.route[attempt.route]
            read, topped = read + 1, topped + clip.climbed.is_topped
            named += route == clip.route
            tops += clip.climbed.is_topped and attempt.top is not None
            wrong_tops += not clip.climbed.is_topped and attempt.top is not None
            print(
                f"clip {clip.number:>2}, {'in a hand' if clip.is_handheld else 'stands   '}: "
                f"camera {camera_error(clip, reading, wall, truth):.1f} px, "
                f"hands F1 {own[0].f1:.2f}, feet {own[1].f1:.2f}, "
                f"route {'right' if route == clip.route else 'wrong'}, "
                f"{clip.climbed.performance.times[-1]:.0f} s read in {took:.0f} s ({spent:.0f} CPU-s)",
                flush=True,
            )
    print(f"{read} of {args.clips} clips read; route named {named}; tops {tops} of {topped}, ")
    print(f"wrong tops {wrong_tops} of {read - topped}")
    for limbs, counts in (("hands", hands), ("feet", feet)):
        print(
            f"{limbs:<6} F1 {counts.f1:.3f}  precision {counts.precision:.3f}  "
            f"recall {counts.recall:.3f}  of {counts.true}"
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
