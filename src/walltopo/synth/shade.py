"""What colour a sample has: bitmaps on facets, solid speckle on holds, baked light, gloss."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["distorted_rays", "noise_table", "shade"]

NOISE_SIZE = 256


def noise_table() -> NDArray[np.float32]:
    """(256, 256) tileable noise of unit spread, white from texel to texel."""
    rng = np.random.default_rng(99)
    return rng.standard_normal((NOISE_SIZE, NOISE_SIZE)).astype(np.float32)


@numba.njit(cache=True, nogil=True, fastmath=True)
def distorted_rays(y0, y1, width, per_side, f, cx, cy, k1, rotation):  # type: ignore[no-untyped-def]
    """World directions (n, 3) float32 of the samples of rows y0..y1 of a SIMPLE_RADIAL camera.

    `rotation` is cam_from_world's; samples go row by row, pixel by pixel, then within a pixel.
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


@numba.njit(cache=True, nogil=True, fastmath=True, inline="always")
def _tile(table, x, y):  # type: ignore[no-untyped-def]
    """Bilinear look-up of the tileable noise."""
    fx, fy = np.floor(x), np.floor(y)
    tx, ty = x - fx, y - fy
    tx, ty = tx * tx * (3 - 2 * tx), ty * ty * (3 - 2 * ty)
    i0, j0 = int(fx) & 255, int(fy) & 255
    i1, j1 = (i0 + 1) & 255, (j0 + 1) & 255
    low = table[j0, i0] * (1 - tx) + table[j0, i1] * tx
    high = table[j1, i0] * (1 - tx) + table[j1, i1] * tx
    return low * (1 - ty) + high * ty


@numba.njit(cache=True, nogil=True, fastmath=True, inline="always")
def _solid(table, p, scale, shift):  # type: ignore[no-untyped-def]
    """Noise in space from three planes; p in metres, scale in bumps a metre."""
    x, y, z = p[0] * scale + shift, p[1] * scale + 0.7 * shift, p[2] * scale + 1.3 * shift
    return 0.6 * (_tile(table, x, y) + _tile(table, y + 37.0, z) + _tile(table, z + 91.0, x))


@numba.njit(cache=True, nogil=True, fastmath=True)
def shade(  # type: ignore[no-untyped-def]
    prim, bu, bv, far, directions, origin, per_pixel, pixel_angle,
    faces, face_facet, face_instance, vertices, normals, own, marks, light, towards,
    texels, levels, charts, linear, rgb, gloss_level, shifts, table, chalk_amount, fog,
    image, ids,
):  # fmt: skip
    """Add the samples' linear colour to `image` (P, 3) and write instance ids to `ids` (S,)."""
    weight = 1.0 / per_pixel
    n, w, p, e = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    way, mark, albedo = np.zeros(3), np.zeros(3), np.zeros(3)
    for s in range(len(prim)):
        face = prim[s]
        if face < 0:
            ids[s] = 0
            continue
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        w[1], w[2] = bu[s], bv[s]
        w[0] = 1.0 - w[1] - w[2]
        ids[s] = face_instance[face]
        facet = face_facet[face]
        for k in range(3):
            e[k] = w[0] * light[a, k] + w[1] * light[b, k] + w[2] * light[c, k]
        shine = 0.0
        if facet >= 0:
            px = origin[0] + directions[s, 0] * far[s] - charts[facet, 0]
            py = origin[1] + directions[s, 1] * far[s] - charts[facet, 1]
            pz = origin[2] + directions[s, 2] * far[s] - charts[facet, 2]
            u = px * charts[facet, 3] + py * charts[facet, 4] + pz * charts[facet, 5]
            v = px * charts[facet, 6] + py * charts[facet, 7] + pz * charts[facet, 8]
            texel = charts[facet, 11]
            level = int(np.log2(max(1.0, far[s] * pixel_angle / texel * 0.8)))
            level = min(level, levels.shape[1] - 1)
            size = texel * 2.0**level
            x = (u - charts[facet, 9]) / size - 0.5
            y = (v - charts[facet, 10]) / size - 0.5
            offset, wide, high = (
                levels[facet, level, 0],
                levels[facet, level, 1],
                levels[facet, level, 2],
            )
            x = min(max(x, 0.0), wide - 1.001)
            y = min(max(y, 0.0), high - 1.001)
            i, j = int(x), int(y)
            i1, j1 = min(i + 1, wide - 1), min(j + 1, high - 1)
            tx, ty = x - i, y - j
            for k in range(3):
                low = (
                    linear[texels[offset + j * wide + i, k]] * (1 - tx)
                    + linear[texels[offset + j * wide + i1, k]] * tx
                )
                top = (
                    linear[texels[offset + j1 * wide + i, k]] * (1 - tx)
                    + linear[texels[offset + j1 * wide + i1, k]] * tx
                )
                albedo[k] = low * (1 - ty) + top * ty
        else:
            inst = face_instance[face]
            length = 0.0
            for k in range(3):
                n[k] = w[0] * normals[a, k] + w[1] * normals[b, k] + w[2] * normals[c, k]
                p[k] = w[0] * own[a, k] + w[1] * own[b, k] + w[2] * own[c, k]
                way[k] = w[0] * towards[a, k] + w[1] * towards[b, k] + w[2] * towards[c, k]
                mark[k] = w[0] * marks[a, k] + w[1] * marks[b, k] + w[2] * marks[c, k]
                length += n[k] * n[k]
            length = 1.0 / np.sqrt(length + 1e-12)
            for k in range(3):
                n[k] *= length
            shift = shifts[inst]
            fine = _solid(table, p, 420.0, shift)
            grain = _solid(table, p, 170.0, shift + 11.0)
            stain = _solid(table, p, 45.0, shift + 23.0)
            slick = mark[1]
            rough = 1.0 - slick
            dark = 1.0 + rough * (0.05 * fine + 0.06 * grain) + 0.06 * stain
            dust = (
                mark[0] * chalk_amount * (0.75 + 0.55 * stain + 0.35 * grain) * (1.0 - 0.6 * slick)
            )
            dust = min(max(dust - 0.22, 0.0), 0.75)
            dirt = min(max(0.55 * (stain - 1.1), 0.0), 0.35) * rough
            for k in range(3):
                base = rgb[inst, k] * dark * (1.0 - dirt)
                base = base * (1.0 - dust) + 0.80 * dust
                albedo[k] = base * (1.0 - mark[2]) + 0.22 * mark[2]
            # The grain tilts the surface a little, more so where light comes from one side.
            g0 = _solid(table, p, 170.0, shift + 41.0)
            g1 = _solid(table, p, 170.0, shift + 67.0)
            tilt = 0.16 * rough * (g0 * way[0] + g1 * way[2])
            vx, vy, vz = (
                way[0] - directions[s, 0],
                way[1] - directions[s, 1],
                way[2] - directions[s, 2],
            )
            half = 1.0 / np.sqrt(vx * vx + vy * vy + vz * vz + 1e-12)
            cosine = (n[0] * vx + n[1] * vy + n[2] * vz) * half
            cosine = max(cosine, 0.0)
            power = cosine**8
            gloss = gloss_level[inst]
            shine = (0.05 * gloss * power + (0.28 * slick + 0.5 * mark[2]) * power**4) * (
                1.0 - dust
            )
            for k in range(3):
                e[k] *= max(0.3, 1.0 + tilt)
        haze = fog * far[s]
        for k in range(3):
            value = e[k] * (albedo[k] + shine)
            image[s // per_pixel, k] += weight * (value * (1.0 - haze) + 0.10 * haze)
