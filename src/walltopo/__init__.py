"""walltopo: phone photos of an indoor climbing wall to a 3D topo."""

__version__ = "0.1.0"
