"""The regression that links holds by their paint: photos in dim, mixed light, and the fit."""
