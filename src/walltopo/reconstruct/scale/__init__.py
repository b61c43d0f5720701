"""Find the scale, the up direction and the floor of a scan, from printed scale plates."""
