"""Clips of attempts: sent by a climber, read against the wall's scan, confirmed, and deleted."""
