"""Readers and writers of the files in a scan folder (COCO, COLMAP, PLY, NPZ)."""
