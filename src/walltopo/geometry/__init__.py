"""Provide rays, z-buffers, mesh topology, graphs, panels and compiled kernels."""
