"""About how hard routes are, by their movement and the gym's own grades: ranges alone."""
