"""Describe a route in words, for climbers who hear the wall instead of seeing it."""
