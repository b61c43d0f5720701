"""Tuning of settings by their metrics on labelled scans; see `docs/evaluate.md`."""
