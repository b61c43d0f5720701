"""Photos to cameras and points, by COLMAP in a child process."""
