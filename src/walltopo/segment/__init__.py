"""Masks to 3D instances: detect, lift, propose."""
