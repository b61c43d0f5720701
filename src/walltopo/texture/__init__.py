"""Photos onto the mesh: one texture atlas without visible seams."""

from walltopo.texture.stage import run

__all__ = ["run"]
