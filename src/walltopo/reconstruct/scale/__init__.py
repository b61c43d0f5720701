"""The measure: metres, up and the floor from printed plates."""
