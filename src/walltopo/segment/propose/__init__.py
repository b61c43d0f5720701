"""Propose holds that protrude from the wall and that few or no masks cover."""
