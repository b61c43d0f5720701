"""What climbers do on the walls, and what they think of the routes."""
