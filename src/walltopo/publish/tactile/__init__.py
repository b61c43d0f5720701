"""A route for the fingers: a relief for a 3D printer, and a drawing for swell paper."""
