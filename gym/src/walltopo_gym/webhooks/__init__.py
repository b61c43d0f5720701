"""Telling a gym's own programs what has changed."""
