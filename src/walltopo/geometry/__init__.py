"""Rays, z-buffers, meshes and graphs."""
