"""Damaged files for every reader: made, read in a watched process, kept when they break it."""
