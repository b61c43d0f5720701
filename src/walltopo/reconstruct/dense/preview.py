"""A coarse mesh of the sparse points alone, as a dense backend: needs no stereo."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.reconstruct.dense.backend import DenseInput
from walltopo.reconstruct.dense.scene import preview_mesh
from walltopo.reconstruct.settings import DenseSettings


@dataclass(frozen=True)
class PreviewBackend:
    """The interpolated sparse points, a `DenseBackend`."""

    name: str
    settings: DenseSettings

    def check(self) -> None:
        """Raise nothing: every machine has what the preview needs."""

    def mesh(self, scan: DenseInput) -> Mesh:
        """Return the mesh; see `scene.preview_mesh`."""
        return preview_mesh(scan.scene, self.settings, scan.edge, scan.unit, scan.progress)
