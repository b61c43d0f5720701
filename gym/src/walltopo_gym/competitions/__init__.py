"""Competitions: what is climbed, who takes part, what judges saw, and who stands where."""
