"""Holds that changed between two versions of a wall, though their routes stayed."""
