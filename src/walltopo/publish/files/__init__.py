"""Other file formats that a wall can be written as."""
