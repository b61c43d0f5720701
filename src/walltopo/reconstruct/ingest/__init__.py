"""Ingest: from whatever a phone produced to upright, comparable, private JPEGs."""
