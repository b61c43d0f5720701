"""Ascents, opinions, sessions, follows and leaderboards of climbers."""
