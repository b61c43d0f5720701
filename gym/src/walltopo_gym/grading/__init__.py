"""Estimated ranges of route difficulty, from movement and the gym's own grades."""
