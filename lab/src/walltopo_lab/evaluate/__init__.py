"""Figures that say how good a result is, against truth; see `docs/evaluate.md`."""
