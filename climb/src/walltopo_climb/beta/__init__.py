"""Reads a clip of a climber: the body in each frame, and the holds that each limb used."""
