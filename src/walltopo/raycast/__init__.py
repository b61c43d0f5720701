"""Which triangle does a pixel or a ray see? A z-buffer for whole photos, a BVH for single rays.

Importing this package imports numba (about half a second): import it where it is used.
"""

from walltopo.raycast.bvh import Bvh
from walltopo.raycast.part import faces_before, own_vertices, render_part
from walltopo.raycast.zbuffer import draw_screen, render_ids

__all__ = ["Bvh", "draw_screen", "faces_before", "own_vertices", "render_ids", "render_part"]
