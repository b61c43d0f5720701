"""Texture the mesh from the photos: one atlas with levelled seams."""
