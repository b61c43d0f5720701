"""The regression that links holds by paint: simulated photos in dim, mixed light, and the fit."""
