"""Rescan a part of a wall: what the new photos show replaces the old surface; the rest stays."""
