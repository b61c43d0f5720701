"""A grade range from the movement of a climb, and what a gym's own grades tell about it."""
