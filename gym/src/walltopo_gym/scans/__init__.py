"""Scans of a wall: their photos, and the job that makes a wall of them."""
