"""Define the shared types, errors, file access and settings; depends on NumPy and msgspec only."""

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
