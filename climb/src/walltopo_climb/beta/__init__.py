"""What a clip of a climber shows: the holds that each limb used, in which order."""
