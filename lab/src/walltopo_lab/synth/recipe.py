"""Generation of a folder of photos with truth from a recipe; existing files are kept."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, Mask, Progress, SettingsError, Silent
from walltopo.core.files import atomic_path, hash_path, read_json, write_json
from walltopo.core.outputs import MARKER
from walltopo.scans.document import parse
from walltopo.scans.segmentation import Rle, decode_segmentation, encode_mask
from walltopo_lab.synth.params import GymSettings, PhotoSettings

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Recipe:
    """All parameters of a generated gym; equal recipes give equal files.

    Parameters
    ----------
    gym, photos : settings.
    seed : seed of the gym and of the photos' path.
    preset : name recorded in `scene.json`, "" if none.
    reset_seed, reset_part : seed and part of a reset of routes (None: no reset).
    photo_seed : seed of the path and exposures, None = `seed`.
    holds : folder of scanned holds to use instead of procedural ones.
    wear_seed : seed of the holds that turned, shifted or are gone (None: none are).
    """

    gym: GymSettings = field(default_factory=GymSettings)
    photos: PhotoSettings = field(default_factory=PhotoSettings)
    seed: int = 0
    preset: str = ""
    reset_seed: int | None = None
    reset_part: str = "all"
    photo_seed: int | None = None
    holds: str | None = None
    wear_seed: int | None = None

    def __post_init__(self) -> None:
        for name in ("seed", "reset_seed", "photo_seed", "wear_seed"):
            value = getattr(self, name)
            if value is not None and value < 0:
                raise SettingsError(f"synth.{name}: expected at least 0, got {value}")

    def as_dict(self) -> dict[str, Any]:
        """Return a JSON-able dict; hash the folder of holds, so that a moved folder is equal."""
        value = dataclasses.asdict(self)
        if self.holds is not None:
            value["holds"] = hash_path(Path(self.holds))
        return value


def read_recipe(folder: Path) -> Recipe:
    """Return the recipe of a generated gym without reset and without scanned holds.

    Raises
    ------
    InputError : the folder is not a generated gym.
    """
    path = folder / "truth" / "recipe.json"
    if not path.is_file():
        raise InputError(f"{folder}: not a generated gym, {path} is missing")
    data = _with_defaults(read_json(path))
    return Recipe(
        GymSettings(**data["gym"]), PhotoSettings(**data["photos"]), data["seed"], data["preset"]
    )


def _check_folder(out: Path, recipe: Recipe) -> None:
    """Reject a folder that contains another gym."""
    path = out / "truth" / "recipe.json"
    wanted = json.loads(json.dumps(recipe.as_dict()))
    if path.is_file():
        present = _with_defaults(read_json(path))
        if present != wanted:
            changed = sorted(k for k in wanted if wanted[k] != present.get(k))
            raise InputError(
                f"{out}: holds a gym of another recipe (differs in {', '.join(changed)})",
                "Choose another folder, or remove this one first.",
            )
    elif out.is_dir() and any(item.name != MARKER for item in out.iterdir()):
        raise InputError(
            f"{out}: is not empty and no generated gym", "Choose a folder that does not exist yet."
        )
    write_json(path, wanted)


def _with_defaults(recipe: dict[str, Any]) -> dict[str, Any]:
    """Return a recipe of an older version with newer settings at their defaults."""
    old = json.loads(json.dumps(Recipe().as_dict()))
    merged = {**old, **recipe}
    for part in ("gym", "photos"):
        merged[part] = {**old[part], **merged[part]}
    return merged


def generate(out: Path, recipe: Recipe, progress: Progress | None = None) -> dict[str, Any]:
    """Build the recipe's gym and photograph it into `out`; an interrupted run resumes.

    Writes `photos/IMG_0000.jpg` ..., `truth/gt.npz`, `truth/scene.json`, `truth/masks.json`,
    `truth/cameras/` (COLMAP) and `truth/recipe.json`.

    Returns
    -------
    Counts: photos, rendered (in this run), instances, routes.
    """
    out = Path(out)
    progress = progress or Silent()
    _check_folder(out, recipe)
    done = out / "truth" / "scene.json"  # written last, so its presence marks a complete folder
    names = [f"IMG_{k:04d}.jpg" for k in range(recipe.photos.photos)]
    if done.is_file() and all((out / "photos" / name).is_file() for name in names):
        scene = read_json(done)
        return _summary(scene, 0)
    from walltopo_lab.synth.gym import Reset, make_gym

    make_hold = None
    if recipe.holds is not None:
        from walltopo_lab.synth.scanned import scanned_holds

        make_hold = scanned_holds(Path(recipe.holds))
    reset = None if recipe.reset_seed is None else Reset(recipe.reset_seed, recipe.reset_part)
    gym = make_gym(recipe.gym, recipe.seed, reset, make_hold, progress, recipe.wear_seed)
    photo_seed = recipe.seed if recipe.photo_seed is None else recipe.photo_seed
    rendered = render_gym(gym, out, recipe.photos, photo_seed, recipe.preset, progress)
    return _summary(read_json(done), rendered)


def _summary(scene: dict[str, Any], rendered: int) -> dict[str, Any]:
    routes = {item["route"] for item in scene["instances"] if item["route"] >= 0}
    return {
        "photos": scene["photos"],
        "rendered": rendered,
        "instances": len(scene["instances"]),
        "routes": len(routes),
    }


def render_gym(
    gym: Any,
    out: Path,
    photos: PhotoSettings,
    seed: int,
    preset: str = "",
    progress: Progress | None = None,
) -> int:
    """Photograph a `Gym` into `out` with all of its truth; return the photos rendered now.

    Parameters
    ----------
    gym : result of `make_gym`.
    out : folder; complete photos in it are kept.
    photos : number, size and style of the photos.
    seed : seed of the path, exposures and noise.
    """
    from walltopo_lab.synth.path import phone_camera, walk_hall
    from walltopo_lab.synth.render import Renderer
    from walltopo_lab.synth.truth import (
        scene_record,
        write_cameras,
        write_ground_truth,
        write_masks,
    )

    progress = progress or Silent()
    camera = phone_camera(photos)
    poses = walk_hall(gym.sections, gym.settings, photos, np.random.default_rng([seed, 9]))
    names = [f"IMG_{k:04d}.jpg" for k in range(len(poses))]
    progress.step("photographing", len(poses))
    renderer = Renderer(gym)
    masks: dict[str, list[tuple[int, Mask]]] = {}
    rendered = 0
    for number, (name, pose) in enumerate(zip(names, poses, strict=True)):
        kept = out / "truth" / "masks" / f"{name}.json"
        if not (kept.is_file() and (out / "photos" / name).is_file()):
            _write_photo(
                renderer, camera, pose, photos, [seed, 20, number], out / "photos" / name, kept
            )
            rendered += 1
        masks[name] = _read_kept(kept, camera)
        progress.advance()
    progress.step("writing the truth")
    info = {"description": f"walltopo synth {preset} seed {gym.seed}".replace("  ", " ")}
    write_masks(out / "truth" / "masks.json", masks, (camera.width, camera.height), info)
    write_cameras(out / "truth" / "cameras", camera, poses, names)
    write_ground_truth(out / "truth" / "gt.npz", gym, camera, poses)
    write_json(out / "truth" / "scene.json", scene_record(gym, preset, names))
    for name in names:
        (out / "truth" / "masks" / f"{name}.json").unlink()
    (out / "truth" / "masks").rmdir()
    return rendered


def _write_photo(
    renderer: Any,
    camera: Camera,
    pose: Floats,
    photos: PhotoSettings,
    seeds: list[int],
    path: Path,
    kept: Path,
) -> None:
    """Write one photo and then its masks; a photo with masks counts as complete."""
    from walltopo_lab.synth.develop import develop, draw_exposure, write_photo
    from walltopo_lab.synth.truth import masks_of

    rng = np.random.default_rng(seeds)
    linear, ids = renderer.render(camera, pose, photos.samples)
    exposure = draw_exposure(photos, renderer.gym.settings.light, rng)
    pixels = develop(linear, exposure, rng)
    with atomic_path(path) as temporary:
        write_photo(temporary, pixels, photos)
    found = masks_of(ids, renderer.gym.instances)
    write_json(kept, [[number, mask.label, encode_mask(mask)] for number, mask in found])


def _read_kept(kept: Path, camera: Camera) -> list[tuple[int, Mask]]:
    rows = parse(read_json(kept), tuple[tuple[int, int, Rle], ...], str(kept))
    return [
        (number, decode_segmentation(rle, camera.width, camera.height, label, 1.0))
        for number, label, rle in rows
    ]
