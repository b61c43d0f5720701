"""Scans of a wall: uploads, photo checks, and the job that runs the product's stages."""
