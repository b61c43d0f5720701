"""Read a climber's movement from a clip: the body in each frame, and the holds of each limb."""
