"""Ground truth of a rendered gym: `gt.npz` and `scene.json`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, Mesh, View
from walltopo.core.files import read_json
from walltopo_lab.evaluate.overlap import Labelled

CLASS_IDS = {"hold": 1, "volume": 2}


@dataclass(frozen=True)
class TrueInstance:
    """One row of `scene.json`: a hold or a volume as set.

    Parameters
    ----------
    id : the value in `face_instance`.
    label : class id, 1 hold, 2 volume.
    kind : jug, crimp, sloper, pinch, pocket, foot or volume.
    colour : name; colours : its one or two colours, its route's first.
    route : >= 0; -1 a volume, part of every route; -2 a downclimb jug, part of none.
    position, normal : (3,) metres, unit; world frame.
    """

    id: int
    label: int
    kind: str
    colour: str
    route: int
    position: tuple[float, ...]
    normal: tuple[float, ...]
    colours: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Truth:
    """The true mesh with its instances, and the true cameras if given.

    Parameters
    ----------
    mesh : (V, 3), (F, 3), metres, z up.
    face_instance : (F,) int32, 0 = none.
    face_views : (F,) int32, number of views that see the face; truth exists only where it is > 0.
    instances : by id; empty without a scene.json (then all count as holds).
    views : the true cameras, undistorted, by photo name; empty if not given.
    """

    mesh: Mesh
    face_instance: NDArray[np.int32]
    face_views: NDArray[np.int32]
    instances: Mapping[int, TrueInstance]
    views: Mapping[str, View] = field(default_factory=dict[str, View])

    @cached_property
    def labelled(self) -> Labelled:
        """Return the labels for the instance metrics."""
        present = (int(i) for i in np.unique(self.face_instance) if i)
        labels = {i: self.instances[i].label if self.instances else 1 for i in present}
        return Labelled(self.face_instance, labels)

    @cached_property
    def ignored(self) -> NDArray[np.bool_]:
        """Return (F,) bool, whether no view saw the face."""
        return self.face_views <= 0


def _instances(path: Path) -> dict[int, TrueInstance]:
    scene = read_json(path)
    try:
        return {
            int(row["id"]): TrueInstance(
                int(row["id"]),
                CLASS_IDS[row["class"]],
                str(row["kind"]),
                str(row["colour"]),
                int(row["route"]),
                tuple(row["position"]),
                tuple(row["normal"]),
                tuple(row.get("colours", [row["colour"]])),
            )
            for row in scene["instances"]
        }
    except (KeyError, TypeError) as error:
        raise InputError(f"{path}: not a scene of this project, {error} is wrong") from error


def _views(data: Mapping[str, Any]) -> dict[str, View]:
    if "cam_from_world" not in data:
        return {}
    width, height = (int(v) for v in data["size"])
    camera = Camera("PINHOLE", width, height, tuple(float(v) for v in data["intrinsics"]))
    poses = data["cam_from_world"]
    names = data.get("names", [f"IMG_{k:04d}.jpg" for k in range(len(poses))])
    return {str(n): View(str(n), camera, p) for n, p in zip(names, poses, strict=True)}


def read_truth(folder: Path) -> Truth:
    """Read the truth from a folder, from its `truth/` folder, or from a `gt.npz` file.

    `scene.json` may lie beside `gt.npz` or one folder up, because the truth of another mesh of the
    same gym has a folder of its own.

    Raises
    ------
    InputError : no truth, or an absent array; the message names it.
    """
    folder = Path(folder)
    places = [folder] if folder.suffix == ".npz" else [folder / "gt.npz", folder / "truth/gt.npz"]
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        raise InputError(
            f"{folder}: no ground truth here",
            "Expected gt.npz (vertices, faces, face_instance, face_views) and scene.json.",
        )
    with np.load(path) as archive:
        data = {name: archive[name] for name in archive.files}
    missing = {"vertices", "faces", "face_instance"} - set(data)
    if missing:
        raise InputError(f"{path}: lacks {', '.join(sorted(missing))}")
    mesh = Mesh(data["vertices"], data["faces"])
    count = len(mesh.faces)
    face_views = data.get("face_views", np.ones(count, dtype=np.int32))
    if len(data["face_instance"]) != count or len(face_views) != count:
        raise InputError(
            f"{path}: {count} faces, but {len(data['face_instance'])} face_instance "
            f"and {len(face_views)} face_views"
        )
    scenes = (path.parent / "scene.json", path.parent.parent / "scene.json")
    scene = next((place for place in scenes if place.is_file()), None)
    instances = _instances(scene) if scene else {}
    stray = {int(i) for i in np.unique(data["face_instance"]) if i} - set(instances)
    if instances and stray:
        raise InputError(f"{scene}: lacks the instances {sorted(stray)[:5]} of {path.name}")
    face_instance = data["face_instance"].astype(np.int32)
    return Truth(mesh, face_instance, face_views.astype(np.int32), instances, _views(data))
