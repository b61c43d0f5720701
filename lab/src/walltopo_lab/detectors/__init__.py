"""Detectors that walltopo-lab adds: Ultralytics families (AGPL-3.0)."""
