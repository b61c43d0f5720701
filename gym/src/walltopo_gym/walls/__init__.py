"""Walls of a gym and its floor plan."""
