"""Start tags: how many are found, and what they do for routes of one colour that touch.

    python -m walltopo_lab.benchmarks.routes_tags fit PHOTOS GYM ...    the weights of `routes/tags.py`
    python -m walltopo_lab.benchmarks.routes_tags find GYM ...      tags found in photos, true cameras and mesh
    python -m walltopo_lab.benchmarks.routes_tags draw GYM FOLDER   what was found, drawn into the photos
    python -m walltopo_lab.benchmarks.routes_tags scan SCAN         tags found in a scan that has none
    python -m walltopo_lab.benchmarks.routes_tags choose            routes, on gyms 3000 to 3019
    python -m walltopo_lab.benchmarks.routes_tags report RECALL PRECISION     the same on gyms 1000 to 1019

Each GYM is a folder of `walltopo synth`; of one that was made before the truth told of tags,
they are painted again. PHOTOS is a folder of real training photos with boxes of holds (YOLO:
`images/`, `labels/`); they teach what is no card: T-nuts with a rim, chalk, markers. A tag counts
if less than a tenth of it is cut off by the panel's edge and two photos show it clearly; a tag is
right if its middle is within 3 cm of a true one.

For the routes: gyms of the generator that are set but not photographed. In `paired` gyms
(`benchmarks/routes_makers.py`) every two neighbouring routes share a colour; in ordinary ones
neighbours differ, and nothing should be cut. Tags are put below the start holds, all of them,
or as many and as right as RECALL and PRECISION say.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from walltopo.core import Camera, Mesh, Silent, View
from walltopo.holds.contract import ClassifySettings
from walltopo.holds.observations import Picture, load_photo
from walltopo.holds.observe import gather
from walltopo.holds.tag_fit import EVIDENCE
from walltopo.holds.tag_looks import CardLook, CardSizes, card_looks
from walltopo.holds.tags import WEIGHTS, FoundTag, TagFinder
from walltopo.raycast import render_ids
from walltopo.routes.contract import RoutesSettings
from walltopo.routes.stage import find_routes
from walltopo.scans.folder import ScanFolder
from walltopo.scans.model import read_views
from walltopo.scans.attributes import StartTag
from walltopo_lab.benchmarks.routes import rand_index
from walltopo_lab.benchmarks.routes_gyms import SetGym, set_gym
from walltopo_lab.benchmarks.routes_makers import paired

Floats = NDArray[np.float64]
NEAR = 0.03  # metres
PHOTOS_TO_FIT = 6  # a gym
REAL_PHOTOS = 40
PIXELS_A_METRE = (200.0, 300.0, 400.0)  # that real photos may have


def true_tags(gym: Path) -> list[dict[str, Any]]:
    """The tags of a gym's truth; painted again, once, where its truth does not tell."""
    kept = gym / "truth" / "tags.json"
    scene = json.loads((gym / "truth" / "scene.json").read_text(encoding="utf-8"))
    if "tags" in scene:
        return list(scene["tags"])
    if not kept.is_file():
        kept.write_text(json.dumps(_painted(gym)), encoding="utf-8")
    return list(json.loads(kept.read_text(encoding="utf-8")))


def _painted(gym: Path) -> list[dict[str, Any]]:
    from walltopo_lab.synth.gym import set_up
    from walltopo_lab.synth.paint import PaintWork, paint_facet
    from walltopo_lab.synth.params import GymSettings
    from walltopo_lab.synth.truth import tag_record

    recipe = json.loads((gym / "truth" / "recipe.json").read_text(encoding="utf-8"))
    settings, seed = GymSettings(**recipe["gym"]), recipe["seed"]
    built = set_up(settings, seed)
    work = PaintWork(settings, seed, built.holds, {v.id: v for v in built.volumes})
    for number, facet in enumerate(built.facets):
        if facet.kind in ("wall", "fin"):
            paint_facet(facet, work, np.random.default_rng([seed, 11, number]))
    return [tag_record(tag) for tag in work.tags]


def _see(gym: Path, every: int, also: Callable[[Picture], None]) -> Mesh:
    """Go through every n-th photo of a gym as the classify stage does, with true instances."""
    mesh, labels = _truth(gym)
    views = read_views(gym / "truth" / "cameras")[::every]
    gather(views, gym / "photos", mesh, labels, ClassifySettings(), Silent(), also)
    return mesh


def _truth(gym: Path) -> tuple[Mesh, NDArray[np.int32]]:
    with np.load(gym / "truth" / "gt.npz") as data:
        mesh = Mesh(data["vertices"], data["faces"].astype(np.int32))
        return mesh, data["face_instance"].astype(np.int32)


def looks_of(gym: Path) -> tuple[list[CardLook], list[int]]:
    """Looks of some photos, and per look 1: of a tag, 0: of none, -1: of a part of one."""
    looks: list[CardLook] = []
    mesh, _ = _truth(gym)
    sizes = CardSizes.of(ClassifySettings(), 1.0)
    count = len(read_views(gym / "truth" / "cameras"))
    _see(
        gym,
        max(1, count // PHOTOS_TO_FIT),
        lambda picture: looks.extend(card_looks(picture, mesh, sizes)),
    )
    places = np.array([tag["position"] for tag in true_tags(gym)])
    looks = [look for look in looks if look.instance == 0 and look.relief <= sizes.flat]
    right = []
    for look in looks:
        away = float(np.linalg.norm(places - look.position, axis=1).min())
        fits = away < 0.02 and abs(look.width - 0.08) < 0.02
        right.append(1 if fits else 0 if away > 0.06 else -1)
    return looks, right


def _plane_at(away: float) -> Mesh:
    """A wall 12 m wide across the z axis, in triangles of 12 cm."""
    steps = np.linspace(-6, 6, 101)
    x, y = (part.ravel() for part in np.meshgrid(steps, steps))
    a = (np.arange(100)[:, None] * 101 + np.arange(100)).ravel()
    faces = [[a, a + 102, a + 1], [a, a + 101, a + 102]]
    corners = np.concatenate([np.column_stack(face) for face in faces]).astype(np.int32)
    return Mesh(np.column_stack([x, y, np.full(len(x), away)]), corners)


def real_looks(folder: Path) -> list[CardLook]:
    """Looks of walls without start cards (hardly any of these photos shows one).

    No camera is known, so the wall is taken for a plane that faces it, in three scales. What
    lies in a hold's box is left out.
    """
    rng = np.random.default_rng(5)
    sizes = CardSizes.of(ClassifySettings(), 1.0)
    found: list[CardLook] = []
    for path in rng.choice(sorted(folder.glob("images/*.jpg")), REAL_PHOTOS, replace=False):
        with Image.open(path) as opened:
            pixels = np.asarray(opened.convert("RGB"))
        height, width = pixels.shape[:2]
        ids = np.zeros((height, width), dtype=np.int32)
        text = (folder / "labels" / f"{path.stem}.txt").read_text(encoding="utf-8")
        for line in text.splitlines():
            corners = np.array([float(word) for word in line.split()[1:]]).reshape(-1, 2)
            if len(corners) == 2:  # centre and size, not a polygon
                corners = corners[0] + np.array([[-0.5], [0.5]]) * corners[1]
            low = np.floor(corners.min(axis=0).clip(0) * (width, height)).astype(int)
            high = np.ceil(corners.max(axis=0) * (width, height)).astype(int)
            ids[low[1] : high[1], low[0] : high[0]] = 1
        away = 1000.0 / rng.choice(PIXELS_A_METRE)
        camera = Camera("SIMPLE_RADIAL", width, height, (1000.0, width / 2, height / 2, 0.0))
        wall = _plane_at(away)
        view = View(path.name, camera, np.eye(3, 4))
        face, depth = render_ids(wall.vertices, wall.faces, camera, view.cam_from_world)
        picture = Picture(0, view, pixels, face, depth, ids)
        found += [look for look in card_looks(picture, wall, sizes) if look.instance == 0]
    return found


def fit(photos: Path, gyms: Sequence[Path]) -> None:
    """Print the weights, and how looks of each gym are told by weights of the others."""
    from sklearn.linear_model import LogisticRegression

    real = real_looks(photos)
    print(f"real photos: {len(real)} looks", flush=True)
    rows = [look.evidence for look in real]
    right, of = [0] * len(real), [-1] * len(real)
    for number, gym in enumerate(gyms):
        looks, own = looks_of(gym)
        rows += [look.evidence for look, fits in zip(looks, own, strict=True) if fits >= 0]
        right += [fits for fits in own if fits >= 0]
        of += [number] * sum(fits >= 0 for fits in own)
        print(f"{gym.name}: {len(looks)} looks, {sum(f == 1 for f in own)} of tags", flush=True)
    # Whether a card has corners is a rule of its own: see `tags.LEAST_CORNERS`.
    evidence, labels, gym_of = np.array(rows)[:, : len(WEIGHTS)], np.array(right), np.array(of)
    spread = evidence.std(axis=0)
    model = LogisticRegression(C=1.0, max_iter=5000)
    sure = np.zeros(len(labels))
    for number in range(len(gyms)):
        rest = gym_of != number
        model.fit(evidence[rest] / spread, labels[rest])
        sure[~rest] = model.predict_proba(evidence[~rest] / spread)[:, 1]
    model.fit(evidence / spread, labels)
    sure[gym_of < 0] = model.predict_proba(evidence[gym_of < 0] / spread)[:, 1]
    for limit in (0.2, 0.5, 0.8):
        found, made = sure > limit, gym_of >= 0
        print(
            f"looks likelier than {limit}: {found[labels == 1].mean():.3f} of those of tags, "
            f"{labels[found & made].mean():.3f} of these are of tags; in the real photos, which "
            f"were learnt from, {int((found & ~made).sum())}"
        )
    for name, weight in zip(EVIDENCE, model.coef_[0] / spread, strict=False):
        print(f"    {weight:.2f},  # {name}")
    print(f"BIAS = {model.intercept_[0]:.2f}")


def found_tags(gym: Path, least: float) -> tuple[list[FoundTag], TagFinder]:
    """The tags found in all photos of a gym."""
    mesh, _ = _truth(gym)
    finder = TagFinder(mesh, CardSizes.of(ClassifySettings(), 1.0))
    _see(gym, 1, finder.read)
    return finder.tags(least), finder


def find(gyms: Sequence[Path]) -> None:
    """Print recall and precision per gym, and together for several confidences."""
    levels = (0.2, 0.3, 0.4, 0.5, 0.6)
    total = {level: np.zeros(4, dtype=int) for level in levels}
    for gym in gyms:
        found, finder = found_tags(gym, min(levels))
        tags = true_tags(gym)
        places = np.array([tag["position"] for tag in tags])
        normals = np.array([tag["normal"] for tag in tags])
        clear = finder.clear_photos(places, normals, np.full(len(tags), 0.075))
        counts = np.array(
            [t["shown"] > 0.9 and len(c) >= 2 for t, c in zip(tags, clear, strict=True)]
        )
        for level in levels:
            own = [tag for tag in found if tag.confidence >= level]
            away = np.full((len(own), len(tags)), np.inf)
            for row, tag in enumerate(own):
                away[row] = np.linalg.norm(places - tag.position, axis=1)
            hit = (away < NEAR).any(axis=0) if own else np.zeros(len(tags), dtype=np.bool_)
            right = int((away < NEAR).any(axis=1).sum())
            total[level] += (int((hit & counts).sum()), int(counts.sum()), right, len(own))
            if level == ClassifySettings().tag_confidence:
                print(
                    f"{gym.name}: {int((hit & counts).sum())} of {int(counts.sum())} tags found, "
                    f"{right} of {len(own)} right",
                    flush=True,
                )
    for level, (hits, wanted, right, told) in total.items():
        print(
            f"tag_confidence {level}: recall {hits / max(wanted, 1):.3f} ({hits} of {wanted}), "
            f"precision {right / max(told, 1):.3f} ({right} of {told})"
        )


def draw(gym: Path, folder: Path) -> None:
    """Found tags green, true ones that were not found magenta; one PNG a photo."""
    import cv2

    found, finder = found_tags(gym, ClassifySettings().tag_confidence)
    places = np.array([tag["position"] for tag in true_tags(gym)])
    mine = np.array([tag.position for tag in found]).reshape(-1, 3)
    folder.mkdir(parents=True, exist_ok=True)
    for view in finder.views.values():
        size = view.camera.width, view.camera.height
        picture = np.ascontiguousarray(load_photo(gym / "photos" / view.name, *size)[..., ::-1])
        for points, colour in ((places, (255, 0, 255)), (mine, (0, 220, 0))):
            for x, y in view.project(points).tolist():
                if np.isfinite((x, y)).all() and abs(x) < 1e4 and abs(y) < 1e4:
                    cv2.circle(picture, (round(x), round(y)), 16, colour, 2, cv2.LINE_AA)
        cv2.imwrite(str(folder / f"{Path(view.name).stem}.png"), picture)


def scan(folder: Path) -> None:
    """Print the tags found in a scan of a wall without tags, at several confidences."""
    from walltopo.holds.doubtful import read_instances
    from walltopo.meshes.ply import read_mesh

    place = ScanFolder(folder)
    mesh = read_mesh(place.mesh)
    labels = read_instances(place, len(mesh.faces)).face_instance
    finder = TagFinder(mesh, CardSizes.of(ClassifySettings(), 1.0))
    views = read_views(place.sparse)
    gather(views, place.photos, mesh, labels, ClassifySettings(), Silent(), finder.read)
    found = finder.tags(0.1)
    print(f"{folder.name}: {len(views)} photos, {len(finder.likely)} looks like a card's")
    for tag in found:
        print(
            f"    confidence {tag.confidence:.2f} at {np.round(tag.position, 2).tolist()}, "
            f"{tag.width:.3f} x {tag.height:.3f}, in {len(tag.looks)} photos, instance "
            f"{tag.instance}"
        )


def put_tags(gym: SetGym, seed: int, recall: float, precision: float) -> list[StartTag]:
    """Tags below the start holds; some missing, and some where none should be.

    Parameters
    ----------
    recall : share of the start holds with a tag; precision : share of tags that belong to a
        start hold, the others are below any hold.
    """
    rng = np.random.default_rng([61, seed])
    climbed = [hold for hold in gym.holds if hold.role == "hold"]
    marked = [hold for hold in climbed if hold.id in gym.starts and rng.random() < recall]
    wrong = rng.poisson(len(marked) * (1 / precision - 1))
    marked += [climbed[k] for k in rng.choice(len(climbed), wrong)]
    tags = []
    for number, hold in enumerate(marked, start=1):
        x, y, z = hold.position
        place = (x + rng.uniform(-0.05, 0.05), y, z - hold.size_m / 2 - 0.04)
        tags.append(StartTag(number, place, colour=hold.colour))
    return tags


def _one_a_route(gym: SetGym) -> SetGym:
    """Only the lowest start hold of each route is marked."""
    lowest: dict[int, tuple[float, int]] = {}
    for hold in gym.holds:
        if hold.id in gym.starts:
            own = (hold.position[2], hold.id)
            route = gym.route[hold.id]
            lowest[route] = min(lowest.get(route, own), own)
    return replace(gym, starts=frozenset(number for _, number in lowest.values()))


def _ways(recall: float, precision: float) -> Iterator[tuple[str, Callable[..., Any]]]:
    yield "without tags", lambda gym, seed: []
    yield "all tags", lambda gym, seed: put_tags(gym, seed, 1.0, 1.0)
    yield "one tag a route", lambda gym, seed: put_tags(_one_a_route(gym), seed, 1.0, 1.0)
    yield (
        f"recall {recall}, precision {precision}",
        lambda gym, seed: put_tags(gym, seed, recall, precision),
    )


def routes(first: int, recall: float, precision: float) -> None:
    """Print ARI by what is known."""
    presets = ("modern", "oldschool-dark", "lead", "modern", "easy")
    seeds = range(first, first + 20)
    kinds = {
        "paired": [paired(seed) for seed in seeds],
        "ordinary": [set_gym(presets[seed % 5], seed) for seed in seeds],
    }
    for kind, gyms in kinds.items():
        for makers in (False, True) if kind == "paired" else (False,):
            settings = RoutesSettings() if makers else RoutesSettings(maker_weight=0.0)
            for name, put in _ways(recall, precision):
                values = []
                for seed, gym in zip(seeds, gyms, strict=True):
                    found, _ = find_routes(gym.mesh, gym.holds, settings, tags=put(gym, seed))
                    values.append(rand_index(found, gym.route))
                known = ", makers known" if makers else ""
                print(
                    f"{kind} gyms, {name}{known}: ARI mean {np.mean(values):.3f}, "
                    f"worst {np.min(values):.3f}",
                    flush=True,
                )


def main() -> None:
    words = sys.argv[1:]
    command, rest = (words[0], words[1:]) if words else ("", [])
    if command == "fit" and rest:
        fit(Path(rest[0]), [Path(word) for word in rest[1:]])
    elif command == "find" and rest:
        find([Path(word) for word in rest])
    elif command == "draw" and len(rest) == 2:
        draw(Path(rest[0]), Path(rest[1]))
    elif command == "scan" and len(rest) == 1:
        scan(Path(rest[0]))
    elif command == "choose" and not rest:
        routes(3000, 0.8, 0.95)
    elif command == "report" and len(rest) == 2:
        routes(1000, float(rest[0]), float(rest[1]))
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main()
