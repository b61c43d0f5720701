"""walltopo: phone photos of an indoor climbing wall to a 3D topo.

    import walltopo

    result = walltopo.scan("photos/", "scan/")              # the whole pipeline
    instances = walltopo.lift(mesh, views, walltopo.LiftParams())  # 2D masks to 3D instances

Everything heavy is imported where it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from walltopo.lazy import lazy_names

if TYPE_CHECKING:
    from walltopo.core import (
        Camera,
        EnvironmentLacksError,
        InputError,
        Instance,
        Instances,
        Mask,
        Mesh,
        SettingsError,
        StageError,
        View,
        WalltopoError,
    )
    from walltopo.geometry.mesh_files import read_mesh
    from walltopo.pipeline.runner import scan
    from walltopo.pipeline.settings import Settings, load_settings
    from walltopo.scans.coco_import import read_coco_masks
    from walltopo.scans.colmap_model import read_views
    from walltopo.segment.lift import LiftParams, lift

    __version__: str

_PLACES = {
    "Camera": "walltopo.core",
    "EnvironmentLacksError": "walltopo.core",
    "InputError": "walltopo.core",
    "Instance": "walltopo.core",
    "Instances": "walltopo.core",
    "LiftParams": "walltopo.segment.lift",
    "Mask": "walltopo.core",
    "Mesh": "walltopo.core",
    "Settings": "walltopo.pipeline.settings",
    "SettingsError": "walltopo.core",
    "StageError": "walltopo.core",
    "View": "walltopo.core",
    "WalltopoError": "walltopo.core",
    "lift": "walltopo.segment.lift",
    "load_settings": "walltopo.pipeline.settings",
    "read_coco_masks": "walltopo.scans.coco_import",
    "read_mesh": "walltopo.geometry.mesh_files",
    "read_views": "walltopo.scans.colmap_model",
    "scan": "walltopo.pipeline.runner",
}

__all__ = [
    "Camera",
    "EnvironmentLacksError",
    "InputError",
    "Instance",
    "Instances",
    "LiftParams",
    "Mask",
    "Mesh",
    "Settings",
    "SettingsError",
    "StageError",
    "View",
    "WalltopoError",
    "__version__",
    "lift",
    "load_settings",
    "read_coco_masks",
    "read_mesh",
    "read_views",
    "scan",
]


_find = lazy_names(__name__, _PLACES)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("walltopo")
    return _find(name)
