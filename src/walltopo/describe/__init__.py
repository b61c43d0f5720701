"""Colour, type and route of each hold; matching of holds between scans."""
