"""A gym to look at: a real scan of the bundled photos, and climbers who are made up."""
