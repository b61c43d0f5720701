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
    from walltopo.formats.coco import read_coco_masks
    from walltopo.formats.colmap import read_views
    from walltopo.formats.ply import read_mesh
    from walltopo.lift.params import LiftParams
    from walltopo.settings import Settings, load_settings

__version__ = "0.1.0"

_LAZY = {
    "LiftParams": "walltopo.lift.params",
    "Settings": "walltopo.settings",
    "load_settings": "walltopo.settings",
    "read_coco_masks": "walltopo.formats.coco",
    "read_mesh": "walltopo.formats.ply",
    "read_views": "walltopo.formats.colmap",
}
_CALLABLE = {"lift", "scan"}  # modules that are called like functions

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
    "load_settings",
    "read_coco_masks",
    "read_mesh",
    "read_views",
]


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    if name in _CALLABLE:
        return importlib.import_module(f"walltopo.{name}")
    raise AttributeError(f"module 'walltopo' has no attribute {name!r}")
