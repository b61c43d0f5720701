"""Shading of ray samples: bitmaps on facets, solid speckle on holds, baked light, gloss."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]
Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]

NOISE_SIZE = 64


class Hits(NamedTuple):
    """The hits of a band's rays: face (-1 none), weights of its corners 1 and 2, distance."""

    face: Ints
    u: Singles
    v: Singles
    far: Singles
    way: Singles


class Shell(NamedTuple):
    """The gym's triangles in the shader's layout; see `mesh.Surface` and `light.Baked`."""

    faces: Ints
    facet: Ints
    instance: Ints
    normals: Singles
    own: Singles
    marks: Singles
    light: Singles
    towards: Singles


class Bitmaps(NamedTuple):
    """The facets' bitmaps, see `atlas.Atlas`; `linear` (256,) is the linear light of sRGB bytes."""

    texels: NDArray[np.uint8]
    levels: NDArray[np.int64]
    charts: Doubles
    linear: Singles


class Finish(NamedTuple):
    """Surface by instance id: linear colour (I, 3), shine, grain, screws (I, S, 2) m, noise shift.

    `second` (I, 3) is the linear colour beyond `plane` (I, 4) in the hold's frame, or of its slick
    part where `on_slick` (I,) is 1. `noise` is the result of `noise_table`; `chalk` is the
    thickness of chalk on all holds.
    """

    rgb: Doubles
    second: Doubles
    plane: Doubles
    on_slick: Doubles
    gloss: Doubles
    grain: Doubles
    screws: Doubles
    shifts: Doubles
    noise: Singles
    chalk: float


def noise_table() -> NDArray[np.float32]:
    """Return (64, 64, 64) tileable noise of unit spread, uncorrelated between cells."""
    rng = np.random.default_rng(99)
    return rng.standard_normal((NOISE_SIZE,) * 3).astype(np.float32)


@numba.njit(cache=True, nogil=True, fastmath=True)
def distorted_rays(y0, y1, width, per_side, f, cx, cy, k1, rotation):  # type: ignore[no-untyped-def]
    """Return world directions (n, 3) float32 of the samples of rows y0..y1, SIMPLE_RADIAL.

    `rotation` is that of cam_from_world. Samples go row by row, pixel by pixel, then within a
    pixel.
    """
    rows = y1 - y0
    out = np.empty((rows * width * per_side * per_side, 3), np.float32)
    index = 0
    for row in range(rows):
        for column in range(width):
            for j in range(per_side):
                for i in range(per_side):
                    xd = (column + (i + 0.5) / per_side - cx) / f
                    yd = (y0 + row + (j + 0.5) / per_side - cy) / f
                    rd = np.sqrt(xd * xd + yd * yd)
                    r = rd
                    for _ in range(6):  # Newton on r (1 + k1 r^2) = rd
                        r -= (r + k1 * r * r * r - rd) / (1.0 + 3.0 * k1 * r * r)
                    s = r / rd if rd > 1e-12 else 1.0
                    x, y = xd * s, yd * s
                    norm = 1.0 / np.sqrt(x * x + y * y + 1.0)
                    for k in range(3):
                        out[index, k] = norm * (
                            rotation[0, k] * x + rotation[1, k] * y + rotation[2, k]
                        )
                    index += 1
    return out


@numba.njit(cache=True, nogil=True, fastmath=True)
def _solid(table, p, scale, shift):  # type: ignore[no-untyped-def]
    """Return smooth 3D noise of unit spread; p in metres, scale in bumps a metre."""
    # Rotate the lattice off the hold's axes, along which it would be visible.
    x = (0.6 * p[0] + 0.64 * p[1] + 0.48 * p[2]) * scale + shift
    y = (-0.8 * p[0] + 0.48 * p[1] + 0.36 * p[2]) * scale + 0.7 * shift
    z = (-0.6 * p[1] + 0.8 * p[2]) * scale + 1.3 * shift
    fx, fy, fz = np.floor(x), np.floor(y), np.floor(z)
    x, y, z = x - fx, y - fy, z - fz
    x, y, z = x * x * (3 - 2 * x), y * y * (3 - 2 * y), z * z * (3 - 2 * z)
    i0, j0, k0 = int(fx) & 63, int(fy) & 63, int(fz) & 63
    i1, j1, k1 = (i0 + 1) & 63, (j0 + 1) & 63, (k0 + 1) & 63
    a = table[k0, j0, i0] * (1 - x) + table[k0, j0, i1] * x
    b = table[k0, j1, i0] * (1 - x) + table[k0, j1, i1] * x
    c = table[k1, j0, i0] * (1 - x) + table[k1, j0, i1] * x
    d = table[k1, j1, i0] * (1 - x) + table[k1, j1, i1] * x
    return 1.7 * ((a * (1 - y) + b * y) * (1 - z) + (c * (1 - y) + d * y) * z)


@numba.njit(cache=True, nogil=True, fastmath=True)
def _bitmap_colour(bitmaps, facet, point, footprint, albedo):  # type: ignore[no-untyped-def]
    """Write the bilinear colour of a facet's bitmap at a world point, from the fitting level."""
    chart = bitmaps.charts[facet]
    u = v = 0.0
    for k in range(3):
        d = point[k] - chart[k]
        u += d * chart[3 + k]
        v += d * chart[6 + k]
    level = int(np.log2(max(1.0, footprint / chart[11] * 0.8)))
    level = min(level, bitmaps.levels.shape[1] - 1)
    size = chart[11] * 2.0**level
    offset = bitmaps.levels[facet, level, 0]
    wide, high = bitmaps.levels[facet, level, 1], bitmaps.levels[facet, level, 2]
    x = min(max((u - chart[9]) / size - 0.5, 0.0), wide - 1.001)
    y = min(max((v - chart[10]) / size - 0.5, 0.0), high - 1.001)
    i, j = int(x), int(y)
    i1, j1 = min(i + 1, wide - 1), min(j + 1, high - 1)
    tx, ty = x - i, y - j
    a, b = offset + j * wide + i, offset + j * wide + i1
    c, d1 = offset + j1 * wide + i, offset + j1 * wide + i1
    texels, linear = bitmaps.texels, bitmaps.linear
    for k in range(3):
        low = linear[texels[a, k]] * (1 - tx) + linear[texels[b, k]] * tx
        top = linear[texels[c, k]] * (1 - tx) + linear[texels[d1, k]] * tx
        albedo[k] = low * (1 - ty) + top * ty


@numba.njit(cache=True, nogil=True, fastmath=True)
def _hold_colour(finish, item, p, mark, albedo):  # type: ignore[no-untyped-def]
    """Write the colour of a hold at a point of its own frame; return the amount of chalk there."""
    table, shift = finish.noise, finish.shifts[item]
    fine = _solid(table, p, 420.0, shift)
    grain = _solid(table, p, 170.0, shift + 11.0)
    stain = _solid(table, p, 45.0, shift + 23.0)
    slick, rough = mark[1], 1.0 - mark[1]
    dark = 1.0 + rough * finish.grain[item] * (0.05 * fine + 0.06 * grain) + 0.06 * stain
    for k in range(finish.screws.shape[1]):
        dx, dy = p[0] - finish.screws[item, k, 0], p[1] - finish.screws[item, k, 1]
        if dx * dx + dy * dy < 1.7e-5:
            dark *= 0.12
    dust = mark[0] * finish.chalk * (0.75 + 0.55 * stain + 0.35 * grain) * (1.0 - 0.6 * slick)
    dust = min(max(dust - 0.22, 0.0), 0.75)
    dirt = min(max(0.55 * (stain - 1.1), 0.0), 0.35) * rough
    height = finish.plane[item, 3]
    for k in range(3):
        height -= finish.plane[item, k] * p[k]
    beyond = min(max(0.5 - height / 0.002, 0.0), 1.0)  # the border is two millimetres wide
    beyond += finish.on_slick[item] * (slick - beyond)
    for k in range(3):
        paint = finish.rgb[item, k] + beyond * (finish.second[item, k] - finish.rgb[item, k])
        base = paint * dark * (1.0 - dirt)
        base = base * (1.0 - dust) + 0.80 * dust
        albedo[k] = base * (1.0 - mark[2]) + 0.22 * mark[2]
    return dust


@numba.njit(cache=True, nogil=True, fastmath=True)
def _shine(finish, item, n, light_way, view_way, mark, dust):  # type: ignore[no-untyped-def]
    """Return gloss (Blinn-Phong): a wide weak lobe everywhere, a tight one on slick parts and
    steel.
    """
    dot = square = 0.0
    for k in range(3):
        h = light_way[k] - view_way[k]
        dot += n[k] * h
        square += h * h
    cosine = max(dot / np.sqrt(square + 1e-12), 0.0)
    lobe = cosine**8
    return (0.05 * finish.gloss[item] * lobe + (0.28 * mark[1] + 0.5 * mark[2]) * lobe**4) * (
        1.0 - dust
    )


@numba.njit(cache=True, nogil=True, fastmath=True, inline="always")
def _blend(out, values, a, b, c, wa, wb, wc):  # type: ignore[no-untyped-def]
    """Interpolate three vertices' triples."""
    for k in range(3):
        out[k] = wa * values[a, k] + wb * values[b, k] + wc * values[c, k]


@numba.njit(cache=True, nogil=True, fastmath=True)
def shade(  # type: ignore[no-untyped-def]
    hits, origin, per_pixel, pixel_angle, fog, shell, bitmaps, finish, image, ids
):
    """Add the samples' linear colour to `image` (P, 3) and write instance ids to `ids` (S,).

    `origin` (3,) is the camera's centre, `pixel_angle` the angle of a pixel in radians, `fog` the
    share of light lost per metre. Each pixel has `per_pixel` consecutive samples.
    """
    n, p, e, way = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    mark, albedo, point = np.zeros(3), np.zeros(3), np.zeros(3)
    for s in range(len(hits.face)):
        face = hits.face[s]
        if face < 0:
            ids[s] = 0
            continue
        a, b, c = shell.faces[face, 0], shell.faces[face, 1], shell.faces[face, 2]
        wb, wc = hits.u[s], hits.v[s]
        wa = 1.0 - wb - wc
        item = shell.instance[face]
        ids[s] = item
        _blend(e, shell.light, a, b, c, wa, wb, wc)
        shine = 0.0
        if shell.facet[face] >= 0:
            for k in range(3):
                point[k] = origin[k] + hits.way[s, k] * hits.far[s]
            _bitmap_colour(bitmaps, shell.facet[face], point, hits.far[s] * pixel_angle, albedo)
        else:
            _blend(p, shell.own, a, b, c, wa, wb, wc)
            _blend(mark, shell.marks, a, b, c, wa, wb, wc)
            _blend(way, shell.towards, a, b, c, wa, wb, wc)
            _blend(n, shell.normals, a, b, c, wa, wb, wc)
            length = 1.0 / np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] + 1e-12)
            for k in range(3):
                n[k] *= length
            dust = _hold_colour(finish, item, p, mark, albedo)
            shine = _shine(finish, item, n, way, hits.way[s], mark, dust)
            # The grain tilts the surface slightly, with more effect under directional light.
            g0 = _solid(finish.noise, p, 170.0, finish.shifts[item] + 41.0)
            g1 = _solid(finish.noise, p, 170.0, finish.shifts[item] + 67.0)
            rough = 0.16 * finish.grain[item] * (1.0 - mark[1])
            bump = max(0.3, 1.0 + rough * (g0 * way[0] + g1 * way[2]))
            for k in range(3):
                e[k] *= bump
        haze = fog * hits.far[s]
        for k in range(3):
            value = e[k] * (albedo[k] + shine)
            image[s // per_pixel, k] += (value * (1.0 - haze) + 0.10 * haze) / per_pixel
