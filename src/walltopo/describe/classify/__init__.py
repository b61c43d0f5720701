"""Describe each hold: colour, type, shape."""
