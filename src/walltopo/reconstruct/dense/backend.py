"""The protocol of all dense backends, and the choice of a backend by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from walltopo.core import Mesh, Progress
from walltopo.core.plugins import PluginGroup
from walltopo.reconstruct.dense.scene import Scene
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.photos import PhotoSet


@dataclass(frozen=True, eq=False)
class DenseInput:
    """The posed photos of which a dense backend makes a mesh.

    World units are those of the COLMAP model: metres, z up, in a scan with a scale; else arbitrary.

    Parameters
    ----------
    photos : the photos; `read_grey` and `read_rgb` return one as (H, W) and (H, W, 3) uint8,
        `people_mask` its pixels that must give no surface, (H, W) bool or None. All are distorted
        as the camera of their view says.
    sparse : the COLMAP model of the photos, a folder of binary files.
    scene : the same model in memory. Poses are `cam_from_world` (x right, y down, z forward).
    edge : target edge length of the mesh, world units.
    unit : length of a metre of the settings, world units; 1 in a scan with a scale.
    cache : the scan's folder for files that only save time or hold logs; it exists.
    progress : receives the steps.
    """

    photos: PhotoSet
    sparse: SparseModel
    scene: Scene
    edge: float
    unit: float
    cache: Path
    progress: Progress


class DenseBackend(Protocol):
    """A way to compute the mesh of a scan from its posed photos."""

    def check(self) -> None:
        """Do nothing if the backend can run on this machine.

        A scan calls this before its first stage, so it must not take seconds.

        Raises
        ------
        EnvironmentLacksError : a program, a package or a device is missing; the hint says what
            to install.
        """

    def mesh(self, scan: DenseInput) -> Mesh:
        """Return the surface that the photos show.

        Returns
        -------
        One mesh in world units, its triangles counter-clockwise as the photos see them. The
        backend cleans it as the settings say (`remesh.finish_surface` does so for a raw one) and
        leaves holes larger than `max_hole` open; the stage fills those and marks the triangles.

        Raises
        ------
        EnvironmentLacksError : as in `check`.
        StageError : no surface can be computed; the hint says what the user can do.
        """


DenseFactory = Callable[[str, DenseSettings], DenseBackend]

# An entry point is called with its own name and the settings, and returns a `DenseBackend`.
BACKENDS: Final[PluginGroup[DenseFactory]] = PluginGroup(
    "walltopo.dense", "dense backend", "not a known dense backend", "or auto."
)


def open_backend(name: str, settings: DenseSettings) -> DenseBackend:
    """Return the dense backend of a name.

    Raises
    ------
    InputError : no installed package has a backend of that name.
    EnvironmentLacksError : its package cannot be imported.
    """
    return BACKENDS.load(name)(name, settings)
