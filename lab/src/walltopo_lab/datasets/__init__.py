"""Labelled photos: formats, checks, and labels from painted meshes; see `docs/datasets.md`."""
