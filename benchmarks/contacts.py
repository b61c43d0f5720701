"""The contacts of bodies that climb routes of generated gyms, found from limbs in a clip.

    python -m benchmarks.contacts FOLDER [--seeds 6300 6301 ...] [--jitter 5]

Makes the gyms in FOLDER where they are missing (their truth alone is used). Each route is climbed by
four bodies as the movement model climbs it, filmed by a still and by a hand-held phone, with the
errors of a pose network: jitter in pixels of a picture 720 wide, hands snapped to the elbow, limbs
out of sight. The baseline takes the nearest hold within .18 m for eight frames in a row, the
best of the minimal rules that were tried (.06 to .22 m, 3 to 13 frames) on the gyms 6300 and 6301.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.two_colours import recipe_of
from walltopo_climb.beta.attempt import attempt_of
from walltopo_climb.beta.contacts import Contact
from walltopo_climb.beta.in_view import LIMBS, Frames, observe, runs_of
from walltopo_climb.movement.body import BODIES
from walltopo_lab.evaluate.contacts import ContactCounts, count_contacts, order_distance
from walltopo_lab.synth.climbs import TrueWall, climb_route, read_true_wall
from walltopo_lab.synth.performance import PoseErrors, TrueContact, film
from walltopo_lab.synth.recipe import generate


@dataclass(frozen=True)
class Clip:
    """A clip of a route, and the truth: contacts by hold id, and whether it ends on the top."""

    frames: Frames
    wall: TrueWall
    route: int
    true: Sequence[TrueContact]
    is_topped: bool


def clips(folder: Path, seed: int, errors: PoseErrors) -> Iterator[Clip]:
    """Yield clips of each route of a gym."""
    rng = np.random.default_rng(seed)
    wall = read_true_wall(folder)
    for route in wall.routes:
        for number, body in enumerate(BODIES.values()):
            done = climb_route(wall, route, body, rng, falls=bool(number % 2))
            if done is None:
                continue
            hips = done.performance.hips.mean(axis=0)
            out = done.outward * [1, 1, 0]
            eye = hips + rng.uniform(3.5, 6.0) * out / np.linalg.norm(out)
            eye[:2] += rng.uniform(-1.5, 1.5) * np.array([-out[1], out[0]])
            eye[2] = rng.uniform(1.2, 1.8)
            frames = film(done.performance, eye, rng, errors, handheld=bool(rng.integers(2)))
            yield Clip(frames, wall, route.id, done.contacts, done.is_topped)


def minimal_rule(clip: Clip, within: float, count: int) -> list[Contact]:
    """Return runs of `count` frames or more whose nearest hold is the same and within reach.

    The true begin and end of the climb are given, so that the ground costs the rule nothing.
    """
    frames, wall = clip.frames, clip.wall.surfaces
    since, until = min(one.begin for one in clip.true), max(one.end for one in clip.true)
    seen = observe(frames, wall)
    found = []
    for limb in range(LIMBS):
        nearest = seen.distance[:, limb].argmin(axis=1)
        is_near = seen.distance[np.arange(len(nearest)), limb, nearest] < within
        states = np.where(is_near, nearest, -1)
        for begin, end in runs_of(states):
            if states[begin] >= 0 and end - begin >= count:
                hold = int(wall.ids[states[begin]])
                times = frames.times
                found.append(
                    Contact(limb, hold, times[begin], times[min(end, len(times) - 1)], 1.0)
                )
    return [one for one in found if one.end > since and one.begin < until]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(6200, 6208)))
    parser.add_argument("--jitter", type=float, default=PoseErrors.jitter)
    parser.add_argument("--rule", type=float, nargs=2, default=(0.18, 8))
    args = parser.parse_args(arguments)
    sums: dict[str, tuple[ContactCounts, ContactCounts, list[float]]] = {
        name: (ContactCounts(), ContactCounts(), []) for name in ("programme", "minimal rule")
    }
    named, spent, seconds = 0, 0.0, 0.0
    tops = Counter[tuple[bool, bool]]()
    for seed in args.seeds:
        folder = args.folder / str(seed)
        if not (folder / "truth" / "scene.json").is_file():
            generate(folder, recipe_of(seed))
        for clip in clips(folder, seed, PoseErrors(jitter=args.jitter)):
            begun = time.process_time()
            attempt = attempt_of(clip.frames, clip.wall.surfaces, clip.wall.routes)
            spent += time.process_time() - begun
            seconds += float(clip.frames.times[-1])
            named += attempt.route == clip.route
            tops[clip.is_topped, attempt.top is not None] += 1
            rule = minimal_rule(clip, args.rule[0], int(args.rule[1]))
            for name, contacts in (("programme", attempt.contacts), ("minimal rule", rule)):
                hands, feet, orders = sums[name]
                count_contacts(contacts, clip.true, hands, feet)
                orders.append(order_distance([c for c in contacts if c.hold], clip.true))
    number = tops.total()
    print(f"{number} clips, {seconds:.0f} s, {spent / seconds:.3f} CPU-s a second of clip")
    print(
        f"route named {named} of {number}; tops found {tops[True, True]} of "
        f"{tops[True, True] + tops[True, False]}, wrong {tops[False, True]} of "
        f"{tops[False, True] + tops[False, False]}"
    )
    for name, (hands, feet, orders) in sums.items():
        for limbs, counts in (("hands", hands), ("feet", feet)):
            print(
                f"{name:<13} {limbs:<6} F1 {counts.f1:.3f}  precision {counts.precision:.3f}  "
                f"recall {counts.recall:.3f}  of {counts.true}"
            )
        print(f"{name:<13} edit distance of the hands' order {np.mean(orders):.3f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
