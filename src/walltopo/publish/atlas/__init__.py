"""A new texture for a simplified wall: few large charts instead of many small ones.

An atlas that was made for millions of triangles has so many seams that the mesh cannot be
simplified without tearing them. So the simplified mesh gets charts of its own (each a patch seen
along one direction) and they are filled with pictures of the detailed, textured mesh, drawn
along the same direction.
"""

from walltopo.publish.atlas.retexture import retexture

__all__ = ["retexture"]
