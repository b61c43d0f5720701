"""walltopo: phone photos of an indoor climbing wall to a 3D topo.

    import walltopo

    result = walltopo.scan("photos/", "scan/")              # the whole pipeline
    instances = walltopo.lift(mesh, views, walltopo.LiftParams())  # 2D masks to 3D instances

Everything heavy is imported where it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from walltopo.geometry.mesh_files import read_mesh
    from walltopo.pipeline.runner import scan
    from walltopo.pipeline.settings import Settings, load_settings
    from walltopo.scans.coco_import import read_coco_masks
    from walltopo.scans.colmap_model import read_views
    from walltopo.segment.lift import LiftParams, lift

    __version__: str

# Name to the module that has it; no room of the package has one of these names.
_LAZY = {
    "LiftParams": "walltopo.segment.lift",
    "Settings": "walltopo.pipeline.settings",
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


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    if name == "__version__":
        from importlib.metadata import version

        return version("walltopo")
    raise AttributeError(f"module 'walltopo' has no attribute {name!r}")
