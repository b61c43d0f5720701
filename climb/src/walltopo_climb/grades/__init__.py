"""Estimate a grade range from the movement of a climb, calibrated by a gym's own grades."""
