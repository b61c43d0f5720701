"""Light, baked per vertex: soft lamps with shadow rays, the hall's glow with occlusion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Facet
from walltopo_lab.synth.mesh import Surface
from walltopo_lab.synth.params import GymSettings
from walltopo_lab.synth.tracer import Tracer

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_REACH = 1.6  # metres beyond which surroundings no longer occlude the hall's glow


@dataclass(frozen=True, eq=False)
class Lamps:
    """Light panels under the ceiling, facing down.

    Parameters
    ----------
    centres : (L, 3) metres.
    half : half sizes of a panel in x and y, metres.
    power : (L,) brightness.
    rgb : (3,) colour, linear.
    glow : brightness of the surrounding hall.
    """

    centres: Floats
    half: tuple[float, float]
    power: Floats
    rgb: tuple[float, float, float]
    glow: float

    def near(self, points: Floats, reach: float) -> Lamps:
        """Return the lamps within `reach` metres (in x and y) of the box around points (n, 3)."""
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        beyond = np.maximum(np.maximum(low - self.centres[:, :2], self.centres[:, :2] - high), 0.0)
        close = np.linalg.norm(beyond, axis=1) <= reach
        return replace(self, centres=self.centres[close], power=self.power[close])


@dataclass(frozen=True, eq=False)
class Baked:
    """The light at the vertices.

    Parameters
    ----------
    irradiance : (V, 3) float32, linear RGB; equals the radiance of a white matt surface.
    towards : (V, 3) float32, mean direction towards the light; shorter = more diffuse.
    """

    irradiance: Singles
    towards: Singles


def hang_lamps(wall: Sequence[Facet], settings: GymSettings, rng: np.random.Generator) -> Lamps:
    """Return a row of lamps in front of the wall's top, independent of its routes."""
    corners = np.concatenate([facet.corners for facet in wall])
    low, high = corners.min(axis=0), corners.max(axis=0)
    x = np.linspace(low[0], high[0], settings.lamps + 2)[1:-1]
    x = x + rng.normal(0, 0.25, settings.lamps)
    y = low[1] - rng.uniform(0.8, 2.6, settings.lamps)
    z = np.full(settings.lamps, settings.height + 1.2)
    power = rng.uniform(0.7, 1.3, settings.lamps)
    warm = settings.warmth + rng.normal(0, 0.05)
    rgb = (1.0, 1.0 - 0.16 * warm, 1.0 - 0.42 * warm)
    return Lamps(np.stack([x, y, z], axis=1), (0.6, 0.25), power, rgb, 0.42)


def _r2_points(count: int, shift: Floats) -> Floats:
    """Return (n, count, 2) low-discrepancy points in the unit square, shifted per row."""
    golden = 1.32471795724474602596
    base = np.arange(1, count + 1)[:, None] * np.array([1 / golden, 1 / golden**2])
    return np.asarray((base[None] + shift[:, None]) % 1.0)


def _tangents(n: Floats) -> tuple[Floats, Floats]:
    helper = np.where(np.abs(n[:, 2:3]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    u = np.cross(helper, n)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(n, u)


def bake_light(
    surface: Surface,
    tracer: Tracer,
    lamps: Lamps,
    settings: GymSettings,
    reach: float = np.inf,
    rays: int = 32,
    lamp_rays: int = 6,
) -> Baked:
    """Return the light at all vertices, computed in blocks.

    Each vertex gets `rays` rays to the hall and `lamp_rays` to each lamp within `reach` metres of
    its block.
    """
    count = len(surface.vertices)
    light = np.zeros((count, 3), np.float32)
    towards = np.zeros((count, 3), np.float32)
    shifts = np.random.default_rng(5).random((count, 2))
    block = 20000
    for start in range(0, count, block):
        part = slice(start, min(start + block, count))
        n = surface.normals[part].astype(np.float64)
        p = surface.vertices[part] + n * 0.003
        glow, sky_way = _hall_light(tracer, p, n, shifts[part], rays)
        direct, lamp_way = _lamp_light(tracer, p, n, shifts[part], lamps.near(p, reach), lamp_rays)
        rgb = np.array(lamps.rgb)
        ambient = glow[:, None] * (0.5 + 0.5 * rgb) * lamps.glow
        light[part] = settings.light * (direct[:, None] * rgb + ambient)
        towards[part] = lamp_way + sky_way * lamps.glow
    light, towards = _smooth_light(surface, light), _smooth_light(surface, towards)
    strength = np.maximum(light.mean(axis=1, keepdims=True) / settings.light, 1e-3)
    length = np.linalg.norm(towards, axis=1, keepdims=True)
    towards = towards / np.maximum(length, 1e-6) * np.clip(length / strength, 0, 1)
    return Baked(light, towards.astype(np.float32))


def _hall_light(
    tracer: Tracer, p: Floats, n: Floats, shift: Floats, rays: int
) -> tuple[Floats, Floats]:
    """Return light from the hall and its mean direction: bright above, dim near other surfaces."""
    u, v = _tangents(n)
    square = _r2_points(rays, shift)
    radius, angle = np.sqrt(square[..., 0]), 2 * np.pi * square[..., 1]
    local = np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - square[..., 0])], axis=-1
    )
    way = local[..., :1] * u[:, None] + local[..., 1:2] * v[:, None] + local[..., 2:] * n[:, None]
    origins = np.repeat(p, rays, axis=0).astype(np.float32)
    far = tracer.distances(origins, way.reshape(-1, 3).astype(np.float32)).reshape(len(p), rays)
    sky = 0.62 + 0.38 * way[..., 2]
    openness = np.clip(far / _REACH, 0, 1) ** 0.7
    value = sky * (0.16 + 0.84 * openness)
    return value.mean(axis=1), (value[..., None] * way).mean(axis=1)


def _lamp_light(
    tracer: Tracer, p: Floats, n: Floats, shift: Floats, lamps: Lamps, rays: int
) -> tuple[Floats, Floats]:
    """Return light from the lamps and its direction, each lamp sampled at `rays` points."""
    total, way = np.zeros(len(p)), np.zeros((len(p), 3))
    for lamp, (centre, power) in enumerate(zip(lamps.centres, lamps.power, strict=True)):
        square = _r2_points(rays, (shift + 0.37 * lamp) % 1.0) * 2 - 1
        points = centre + np.concatenate(
            [square * np.array(lamps.half), np.zeros((*square.shape[:2], 1))], axis=-1
        )
        ray = points - p[:, None]
        length = np.linalg.norm(ray, axis=-1)
        ray = ray / length[..., None]
        cosine = np.clip((ray * n[:, None]).sum(axis=-1), 0, None)
        value = power * 7.5 * cosine * np.clip(ray[..., 2], 0, None) / (length**2 + 1.0)
        lit = value > 1e-4
        seen = np.zeros(lit.shape)
        origins = np.broadcast_to(p[:, None], ray.shape)[lit].astype(np.float32)
        if len(origins):
            far = tracer.distances(origins, ray[lit].astype(np.float32))
            seen[lit] = far > length[lit] - 0.02
        value = value * seen / len(square[0])
        total += value.sum(axis=1)
        way += (value[..., None] * ray).sum(axis=1)
    return total, way


def _smooth_light(surface: Surface, values: Singles, rounds: int = 2) -> Singles:
    """Average over the neighbours along edges, to remove the grain of the sampled light."""
    from scipy.sparse import coo_array, diags_array

    faces, count = surface.faces, len(surface.vertices)
    rows = np.concatenate([faces[:, k] for k in (0, 1, 2)])
    columns = np.concatenate([faces[:, k] for k in (1, 2, 0)])
    ones = np.ones(len(rows), np.float32)
    near = coo_array((ones, (rows, columns)), shape=(count, count)).tocsr()
    near.data[:] = 1.0
    degree = np.maximum(np.asarray(near.sum(axis=1)).ravel(), 1.0)
    average = diags_array((1.0 / degree).astype(np.float32)) @ near
    for _ in range(rounds):
        values = (0.5 * values + 0.5 * (average @ values)).astype(np.float32)
    return values
