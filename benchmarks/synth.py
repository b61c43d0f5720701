"""Cost of a generated gym, and reconstruction quality of its photos.

python -m benchmarks.synth pictures docs/pictures/synth   # the pictures of docs/synth.md
python -m benchmarks.synth speed                          # CPU-seconds of a 2 MP photo
python -m benchmarks.synth colmap FOLDER                  # COLMAP against a gym's truth
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from walltopo.scans.colmap_model import view_of_image
from walltopo_lab.synth import PRESETS, PhotoSettings, gym_preset, make_gym

# Seed, and the photos to show out of a walk of 12, for each preset.
SHOWN = {
    "easy": (3, (1, 5)),
    "modern": (3, (2, 4)),
    "oldschool-dark": (5, (0, 3)),
    "sprawall": (5, (1, 5)),
    "lead": (4, (2, 7)),
}


def pictures(out: Path, presets: Sequence[str]) -> None:
    """Write two photos of every preset, side by side, as small JPEGs."""
    from PIL import Image

    from walltopo_lab.synth.develop import develop, draw_exposure
    from walltopo_lab.synth.path import phone_camera, walk_poses
    from walltopo_lab.synth.render import Renderer

    out.mkdir(parents=True, exist_ok=True)
    for name in presets:
        seed, numbers = SHOWN[name]
        gym_settings, photo_settings = gym_preset(name)
        photo_settings = replace(photo_settings, photos=12, width=960, height=720)
        gym = make_gym(gym_settings, seed)
        poses = walk_poses(
            gym.wall, gym.plates, gym_settings, photo_settings, np.random.default_rng([seed, 9])
        )
        renderer, tiles = Renderer(gym), []
        for number in numbers:
            rng = np.random.default_rng([seed, 20, number])
            linear, _ = renderer.render(phone_camera(photo_settings), poses[number], 2)
            exposure = draw_exposure(photo_settings, gym_settings.light, rng)
            tiles.append(develop(linear, exposure, rng))
        sheet = Image.fromarray(np.hstack(tiles)).resize((1280, 480))
        sheet.save(out / f"{name}.jpg", quality=80)
        print(f"{name}: {len(gym.instances)} instances, {len(gym.surface.faces)} faces")


def speed(presets: Sequence[str]) -> None:
    """Print CPU-seconds and wall seconds of one photo, and CPU-seconds of building the gym.

    A photo of 1632x1224 is rendered, developed and gets its masks.
    """
    from walltopo_lab.synth.develop import develop, draw_exposure
    from walltopo_lab.synth.path import phone_camera, walk_poses
    from walltopo_lab.synth.render import Renderer
    from walltopo_lab.synth.truth import masks_of

    for name in presets:
        settings, _ = gym_preset(name)
        photos = PhotoSettings(photos=4, width=1632, height=1224)
        cpu = time.process_time()
        gym = make_gym(settings, 1)
        built = time.process_time() - cpu
        poses = walk_poses(gym.wall, gym.plates, settings, photos, np.random.default_rng(1))
        renderer = Renderer(gym)
        renderer.render(phone_camera(photos), poses[0], 1)  # compile
        cpu, wall = time.process_time(), time.perf_counter()
        for pose in poses[1:]:
            linear, ids = renderer.render(phone_camera(photos), pose, 2)
            rng = np.random.default_rng(0)
            develop(linear, draw_exposure(photos, settings.light, rng), rng)
            masks_of(ids, gym.instances)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        print(
            f"{name:15s} gym {built:5.1f} CPU-s, photo {cpu / 3:4.2f} CPU-s, {wall / 3:4.2f} s"
            f" wall ({len(gym.surface.faces)} faces)"
        )


def colmap(folder: Path) -> None:
    """Register the photos with pycolmap and print the errors against the truth."""
    from walltopo.geometry.colmap import pycolmap

    truth = np.load(folder / "truth" / "gt.npz")
    with tempfile.TemporaryDirectory() as work:
        database = f"{work}/database.db"
        extraction = pycolmap.FeatureExtractionOptions()
        extraction.sift.first_octave = 0
        pycolmap.extract_features(
            database,
            folder / "photos",
            camera_mode=pycolmap.CameraMode.SINGLE,
            reader_options=pycolmap.ImageReaderOptions(camera_model="SIMPLE_RADIAL"),
            extraction_options=extraction,
        )
        pycolmap.match_exhaustive(database)
        models = pycolmap.incremental_mapping(database, folder / "photos", work)
        model = max(models.values(), key=lambda m: m.num_reg_images())
        views = [view_of_image(image) for image in model.images.values() if image.has_pose]
        poses = [truth["cam_from_world"][int(view.name[4:8])] for view in views]
        centres = np.array([-p[:, :3].T @ p[:, 3] for p in poses])
        found = np.array([view.centre for view in views])
        fit = pycolmap.estimate_sim3d(found, centres).matrix()
        error = np.linalg.norm(found @ fit[:, :3].T + fit[:, 3] - centres, axis=1) * 1000
        print(
            f"registered {len(views)} of {len(truth['cam_from_world'])}, "
            f"{model.num_points3D()} points, {model.compute_mean_reprojection_error():.2f} px; "
            f"centres after a fit: median {np.median(error):.2f} mm, worst {error.max():.2f} mm; "
            f"camera {views[0].camera.params} (true f {truth['intrinsics'][0]:.2f}, "
            f"k1 {truth['distortion'][0]})"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("pictures").add_argument("out", type=Path)
    commands.add_parser("speed")
    commands.add_parser("colmap").add_argument("folder", type=Path)
    parser.add_argument("--preset", action="append", choices=tuple(PRESETS), help="only this one")
    args = parser.parse_args()
    presets = args.preset or list(PRESETS)
    if args.command == "pictures":
        pictures(args.out, presets)
    elif args.command == "speed":
        speed(presets)
    else:
        colmap(args.folder)


if __name__ == "__main__":
    main()
