"""Define the shared types, errors, file access and settings; depends on NumPy and msgspec only.

Each name is imported when it is first used: a command that only shows its help needs no NumPy.
"""

from typing import TYPE_CHECKING

from walltopo.lazy import lazy_names

if TYPE_CHECKING:
    from walltopo.core.errors import (
        BusyError,
        EnvironmentLacksError,
        InputError,
        SettingsError,
        StageError,
        WalltopoError,
    )
    from walltopo.core.instances import Instance, Instances
    from walltopo.core.mesh import Mesh
    from walltopo.core.progress import Progress, Silent
    from walltopo.core.settings import SettingField, about, check_settings, settings_of
    from walltopo.core.view import Camera, Mask, View

_NAMES = {
    "errors": (
        "BusyError",
        "EnvironmentLacksError",
        "InputError",
        "SettingsError",
        "StageError",
        "WalltopoError",
    ),
    "instances": ("Instance", "Instances"),
    "mesh": ("Mesh",),
    "progress": ("Progress", "Silent"),
    "settings": ("SettingField", "about", "check_settings", "settings_of"),
    "view": ("Camera", "Mask", "View"),
}

__all__ = [
    "BusyError",
    "Camera",
    "EnvironmentLacksError",
    "InputError",
    "Instance",
    "Instances",
    "Mask",
    "Mesh",
    "Progress",
    "SettingsError",
    "Silent",
    "StageError",
    "View",
    "WalltopoError",
    "SettingField",
    "about",
    "check_settings",
    "settings_of",
]
__getattr__ = lazy_names(
    __name__,
    {name: f"walltopo.core.{module}" for module, names in _NAMES.items() for name in names},
)
