"""Colours of holds: setters' names and sRGB albedo."""

from __future__ import annotations

RGB = tuple[float, float, float]
DOWNCLIMB_GREY: RGB = (0.50, 0.50, 0.51)

PALETTES: dict[str, dict[str, RGB]] = {
    "vivid": {
        "red": (0.78, 0.09, 0.10),
        "yellow": (0.93, 0.77, 0.08),
        "blue": (0.08, 0.33, 0.76),
        "green": (0.10, 0.52, 0.20),
        "black": (0.075, 0.075, 0.08),
        "white": (0.88, 0.88, 0.86),
        "orange": (0.94, 0.43, 0.06),
        "pink": (0.91, 0.24, 0.55),
        "purple": (0.40, 0.18, 0.60),
        "turquoise": (0.10, 0.62, 0.64),
        "lime": (0.58, 0.80, 0.13),
    },
    # years of chalk, shoe rubber and pressure washing
    "faded": {
        "red": (0.55, 0.17, 0.15),
        "yellow": (0.70, 0.58, 0.20),
        "blue": (0.17, 0.29, 0.48),
        "green": (0.19, 0.38, 0.23),
        "black": (0.12, 0.115, 0.11),
        "white": (0.66, 0.64, 0.58),
        "orange": (0.66, 0.36, 0.16),
        "purple": (0.33, 0.21, 0.40),
        "brown": (0.36, 0.24, 0.16),
    },
    # colours close to a painted wall's, with white and black beside them
    "plain": {
        "white": (0.86, 0.86, 0.84),
        "grey": (0.62, 0.63, 0.65),
        "black": (0.09, 0.09, 0.095),
        "beige": (0.74, 0.68, 0.58),
        "slate": (0.34, 0.36, 0.39),
    },
    # white, grey and black routes together, with three clear colours
    "neutral": {
        "white": (0.87, 0.87, 0.85),
        "grey": (0.50, 0.50, 0.51),
        "black": (0.08, 0.08, 0.085),
        "red": (0.78, 0.09, 0.10),
        "yellow": (0.93, 0.77, 0.08),
        "blue": (0.08, 0.33, 0.76),
    },
}
