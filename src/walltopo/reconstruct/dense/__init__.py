"""Posed photos to one triangle mesh, by one of several backends."""
