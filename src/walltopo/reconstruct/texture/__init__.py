"""Photos onto the mesh: one texture atlas without visible seams."""
