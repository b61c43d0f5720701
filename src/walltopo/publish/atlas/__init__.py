"""Make a new texture for a simplified wall: few large charts instead of many small ones.

An atlas made for millions of triangles has so many seams that simplification would tear the mesh.
The simplified mesh therefore gets its own charts (each a connected component viewed along one
direction), filled with pictures of the detailed, textured mesh along the same direction.
"""

from walltopo.publish.atlas.retexture import retexture

__all__ = ["retexture"]
