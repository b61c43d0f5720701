"""Writers of other file formats for a wall."""
