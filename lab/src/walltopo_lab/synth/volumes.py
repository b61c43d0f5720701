"""Volumes, shared by all routes: of plywood, or round ones of fibreglass."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Facet, GymInstance
from walltopo_lab.synth.params import GymSettings
from walltopo_lab.synth.tnuts import behind_fins

Floats = NDArray[np.float64]
DOME_SIDES, DOME_RINGS = 24, 6

_PAINTS: dict[str, tuple[tuple[str, tuple[float, float, float]], ...]] = {
    "vivid": (
        ("wood", (0.72, 0.56, 0.38)),
        ("grey", (0.52, 0.53, 0.55)),
        ("white", (0.86, 0.85, 0.82)),
        ("black", (0.13, 0.13, 0.14)),
        ("blue", (0.16, 0.36, 0.62)),
        ("wood", (0.66, 0.50, 0.34)),
    ),
    "faded": (
        ("wood", (0.60, 0.46, 0.30)),
        ("wood", (0.52, 0.40, 0.27)),
        ("grey", (0.40, 0.40, 0.40)),
    ),
    "plain": (
        ("black", (0.10, 0.10, 0.105)),
        ("slate", (0.26, 0.27, 0.29)),
        ("grey", (0.58, 0.59, 0.60)),
    ),
    "neutral": (
        ("grey", (0.52, 0.53, 0.55)),
        ("black", (0.13, 0.13, 0.14)),
        ("wood", (0.66, 0.50, 0.34)),
    ),
}


def _make_polyhedron(rng: np.random.Generator) -> tuple[Floats, list[Floats]]:
    """Return outline (N, 2) and polygons of a plywood volume."""
    outline, top = _make_shape(rng)
    return outline, _volume_faces(outline, top)


def _make_shape(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return outline (N, 2) on the wall, counter-clockwise, and top points (1 or N, 3); metres."""
    corners = int(rng.integers(3, 6))
    size = rng.uniform(0.22, 0.52)
    angles = np.sort(np.arange(corners) / corners * 2 * np.pi + rng.uniform(-0.35, 0.35, corners))
    radii = size * rng.uniform(0.75, 1.15, corners)
    outline = np.stack([np.cos(angles), np.sin(angles)], axis=1) * radii[:, None]
    outline[:, 1] *= rng.uniform(0.7, 1.0)
    depth = size * rng.uniform(0.35, 0.75)
    shift = rng.uniform(-0.25, 0.25, 2) * size
    if corners == 4 and rng.random() < 0.5:
        cut = rng.uniform(0.25, 0.6)  # a truncated pyramid repeats the outline, smaller
        top = np.column_stack([outline * cut + shift, np.full(corners, depth)])
        return outline, top
    return outline, np.array([[shift[0], shift[1], depth]])


def _volume_faces(outline: Floats, top: Floats) -> list[Floats]:
    """Return polygons (3 or 4, 3) of the volume in its frame, its back 2 cm in the wall.

    `outline` and `top` as `_make_shape` returns them.
    """
    count = len(outline)
    base = np.column_stack([outline, np.full(count, -0.02)])
    polygons = []
    for k in range(count):
        after = (k + 1) % count
        if len(top) == 1:
            polygons.append(np.array([base[k], base[after], top[0]]))
        else:
            polygons.append(np.array([base[k], base[after], top[after], top[k]]))
    if len(top) > 1:
        polygons.append(top)
    back = base[::-1]
    polygons += [np.array([back[0], back[k], back[k + 1]]) for k in range(1, count - 1)]
    return polygons


def _make_dome(rng: np.random.Generator) -> tuple[Floats, list[Floats]]:
    """Return outline (24, 2) and polygons of a round volume: a flat oval dome, edge rounded."""
    size, aspect = rng.uniform(0.2, 0.45), rng.uniform(0.6, 1.0)
    depth = size * rng.uniform(0.35, 0.8)
    turn = rng.uniform(0, 2 * np.pi)
    angles = np.arange(DOME_SIDES) / DOME_SIDES * 2 * np.pi
    oval = np.stack([np.cos(angles), aspect * np.sin(angles)], axis=1) * size
    c, s = np.cos(turn), np.sin(turn)
    outline = oval @ np.array([[c, s], [-s, c]])
    rise = np.linspace(0.0, 0.5 * np.pi, DOME_RINGS + 1)[:-1]
    heights = depth * np.sin(rise)
    heights[0] = -0.02
    rings = [
        np.column_stack([outline * np.cos(angle), np.full(DOME_SIDES, height)])
        for angle, height in zip(rise, heights, strict=True)
    ]
    apex = np.array([0.0, 0.0, depth])
    after = np.roll(np.arange(DOME_SIDES), -1)
    polygons = [
        np.array([low[k], low[after[k]], high[after[k]], high[k]])
        for low, high in pairwise(rings)
        for k in range(DOME_SIDES)
    ]
    polygons += [np.array([rings[-1][k], rings[-1][after[k]], apex]) for k in range(DOME_SIDES)]
    back = rings[0][::-1]
    polygons += [np.array([back[0], back[k], back[k + 1]]) for k in range(1, DOME_SIDES - 1)]
    return outline, polygons


def place_volumes(
    wall: list[Facet], settings: GymSettings, rng: np.random.Generator
) -> tuple[list[Facet], list[GymInstance]]:
    """Return facets and records of the volumes; ids from 1."""
    facets: list[Facet] = []
    records: list[GymInstance] = []
    fins = [facet for facet in wall if facet.kind == "fin"]
    areas = np.array([np.linalg.norm(np.cross(*(f.corners[1:3] - f.corners[0]))) for f in wall])
    taken: list[tuple[Floats, float]] = []
    paint = _PAINTS[settings.colours]
    for _ in range(settings.volumes * 30):
        if len(records) == settings.volumes:
            break
        host = wall[int(rng.choice(len(wall), p=areas / areas.sum()))]
        # Without round volumes nothing is drawn, so that gyms from before this setting are
        # unchanged.
        is_round = settings.round_volumes > 0 and rng.random() < settings.round_volumes
        outline, polygons = _make_dome(rng) if is_round else _make_polyhedron(rng)
        weights = rng.dirichlet(np.ones(len(host.corners)) * 2)
        centre = weights @ host.corners
        radius = float(np.linalg.norm(outline, axis=1).max())
        low, high = 0.75, settings.height - 0.5
        hidden = host.kind != "fin" and behind_fins(fins, centre[None], 0.8 * radius)[0]
        apart = not hidden and all(np.linalg.norm(centre - c) > radius + r + 0.12 for c, r in taken)
        if host.inside(centre) < 0.75 * radius or not low < centre[2] < high or not apart:
            continue
        taken.append((centre, radius))
        number = len(records) + 1
        # Fibreglass has no bare wood finish.
        colours = [entry for entry in paint if entry[0] != "wood"] if is_round else paint
        name, rgb = colours[int(rng.integers(len(colours)))]
        rotation = np.stack(host.frame, axis=1)
        kind = "dome" if is_round else "volume"
        for polygon in polygons:
            world = centre + polygon @ rotation.T
            facets.append(Facet(world, kind, number, 0.003, int(rng.integers(1 << 16))))
        records.append(
            GymInstance(
                number, "volume", "volume", name, rgb, -1, centre, host.frame[2], role="volume"
            )
        )
    return facets, records


def volume_footprint(record: GymInstance, facets: list[Facet]) -> float:
    """Return the largest distance of a volume's corners from its mounting point, metres."""
    corners = np.concatenate([f.corners for f in facets if f.instance == record.id])
    return float(np.linalg.norm(corners - record.position, axis=1).max())
