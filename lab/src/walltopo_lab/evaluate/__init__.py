"""Metrics that compare a result with ground truth; see `docs/evaluate.md`."""
