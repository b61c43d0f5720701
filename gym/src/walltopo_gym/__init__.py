"""The platform on which gyms publish their walls: `walltopo gym`."""
