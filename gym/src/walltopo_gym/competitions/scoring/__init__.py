"""Scoring rules: pure functions from marks to a score."""
