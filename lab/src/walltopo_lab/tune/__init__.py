"""Choosing settings by their figures on labelled scans; see `docs/evaluate.md`."""
