"""Documented inspections of walls: what is due, the checks, and signed records."""
