"""A hold with the measures of its triangles."""

from __future__ import annotations

from msgspec.structs import replace

from walltopo.holds.geometry import Shape
from walltopo.scans.attributes import Hold

__all__ = ["with_shape"]


def with_shape(hold: Hold, shape: Shape) -> Hold:
    """The hold with the place and the measures of a shape."""
    x, y, z = shape.position.tolist()
    nx, ny, nz = shape.normal.tolist()
    return replace(
        hold,
        position=(x, y, z),
        normal=(nx, ny, nz),
        size=shape.size,
        area=shape.area,
        steepness_deg=shape.steepness_deg,
    )
