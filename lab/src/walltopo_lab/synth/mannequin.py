"""A jointed body for rendered clips: bones from hands, feet and hips; drawn before a picture.

The body is a smooth union of cones with round ends (quilez' smooth minimum), found along each
pixel's ray by sphere tracing (Hart 1996).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.geometry.kernels import kernel
from walltopo_climb.movement.body import Body

Floats = NDArray[np.float64]

_SKIN, _SHIRT, _TROUSERS, _SHOES, _HAIR, _BAG = range(6)
_BLEND: Final = 0.025  # m, of two parts that meet
_STEPS: Final = 70
_NEAR: Final = 0.0015  # m from the surface at which a ray has arrived
_FORWARD: Final = 0.35  # of the elbows and knees, out of the wall


@dataclass(frozen=True)
class Clothes:
    """The colours of a body, linear RGB by part: skin, shirt, trousers, shoes, hair, bag.

    Parameters
    ----------
    colours : (6, 3) in [0, 1]. build : factor of the widths. sleeves, legs : whether they are long.
    """

    colours: Floats
    build: float
    sleeves: bool
    legs: bool


def draw_clothes(rng: np.random.Generator) -> Clothes:
    """Return random clothes and skin."""
    light = np.array([0.62, 0.38, 0.27])
    dark = np.array([0.10, 0.05, 0.03])
    share = rng.uniform(0, 1)
    colours = rng.uniform(0.02, 0.6, (6, 3))
    colours[_SKIN] = share * light + (1 - share) * dark
    colours[_TROUSERS] = rng.choice([0.02, 0.05, 0.12, 0.3]) * rng.uniform(0.7, 1.3, 3)
    colours[_HAIR] = rng.uniform(0.01, 0.25) * np.array([1.0, 0.75, 0.5])
    return Clothes(
        colours, float(rng.uniform(0.9, 1.15)), bool(rng.random() < 0.3), bool(rng.random() < 0.7)
    )


@dataclass(frozen=True)
class Skeleton:
    """The joints of a body, each (3,) m: by name, left before right."""

    hips: Floats
    neck: Floats
    head: Floats
    shoulders: tuple[Floats, Floats]
    elbows: tuple[Floats, Floats]
    hands: tuple[Floats, Floats]
    pelvis: tuple[Floats, Floats]
    knees: tuple[Floats, Floats]
    feet: tuple[Floats, Floats]


def skeleton_of(limbs: Floats, hips: Floats, body: Body, out: Floats, side: Floats) -> Skeleton:
    """Return the joints of a body whose hands and feet are known.

    Parameters
    ----------
    limbs : (4, 3) m, fingers and toes. hips : (3,) m.
    out, side : unit vectors out of the wall and to the climber's right.
    """
    reach = limbs[:2].mean(axis=0) - hips
    up = np.array([0.0, 0.0, 1.0])
    spine = _unit(1.4 * up + _unit(reach) + 0.15 * out)
    neck = hips + body.torso * spine
    across = _unit(side - (side @ spine) * spine)
    tilt = _unit(across + 0.25 * _unit(limbs[1] - limbs[0]))
    half = 0.5 * 0.8 * body.shoulders
    shoulders = neck - half * tilt - 0.05 * spine, neck + half * tilt - 0.05 * spine
    pelvis = hips - 0.09 * across, hips + 0.09 * across
    elbows = tuple(
        _joint_position(s, h, 0.44 * body.arm, -0.5 * up + sign * 0.7 * side + _FORWARD * out)
        for s, h, sign in zip(shoulders, limbs[:2], (-1, 1), strict=True)
    )
    knees = tuple(
        _joint_position(p, f, 0.5 * body.leg, sign * 0.8 * side + 0.25 * up + 0.2 * out)
        for p, f, sign in zip(pelvis, limbs[2:], (-1, 1), strict=True)
    )
    head = neck + 0.13 * body.height * _unit(spine - 0.1 * out)
    return Skeleton(
        hips, neck, head, shoulders, (elbows[0], elbows[1]), (limbs[0], limbs[1]),
        pelvis, (knees[0], knees[1]), (limbs[2], limbs[3]),
    )  # fmt: skip


def _unit(vector: Floats) -> Floats:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)


def _joint_position(a: Floats, b: Floats, length: float, towards: Floats) -> Floats:
    """Return the joint between two ends of a limb whose halves have this length."""
    way = b - a
    half = min(float(np.linalg.norm(way)) / 2, length)
    height = np.sqrt(max(length**2 - half**2, 0.0))
    axis = _unit(way)
    return (a + b) / 2 + height * _unit(towards - (towards @ axis) * axis)


def parts_of(bones: Skeleton, body: Body, clothes: Clothes, out: Floats) -> tuple[Floats, Floats]:
    """Return the parts of a body: (N, 8) begin, end m, both radii m; and (N, 3) colours."""
    up = _unit(bones.neck - bones.hips)
    w = clothes.build * body.height / 1.75
    chest = bones.hips + 0.72 * (bones.neck - bones.hips)
    arms = _SHIRT if clothes.sleeves else _SKIN
    calves = _TROUSERS if clothes.legs else _SKIN
    rows: list[tuple[Floats, Floats, float, float, int]] = [
        (bones.pelvis[0], bones.pelvis[1], 0.105 * w, 0.105 * w, _TROUSERS),
        (bones.hips + 0.05 * up, chest, 0.115 * w, 0.13 * w, _SHIRT),
        (
            chest - 0.06 * _unit(bones.shoulders[1] - bones.shoulders[0]),
            chest + 0.06 * _unit(bones.shoulders[1] - bones.shoulders[0]),
            0.125 * w, 0.125 * w, _SHIRT,
        ),
        (bones.shoulders[0], bones.shoulders[1], 0.068 * w, 0.068 * w, _SHIRT),
        (bones.neck - 0.02 * up, bones.head - 0.03 * up, 0.05 * w, 0.05 * w, _SKIN),
        (bones.head - 0.025 * up, bones.head + 0.02 * up, 0.083, 0.09, _SKIN),
        (bones.head + 0.015 * up + 0.02 * out, bones.head + 0.035 * up + 0.02 * out, 0.093, 0.09,
         _HAIR),
        (bones.hips + 0.12 * out - 0.04 * up, bones.hips + 0.13 * out + 0.06 * up, 0.055, 0.06,
         _BAG),
    ]  # fmt: skip
    for left in (0, 1):
        shoulder, elbow, hand = bones.shoulders[left], bones.elbows[left], bones.hands[left]
        pelvis, knee, foot = bones.pelvis[left], bones.knees[left], bones.feet[left]
        along = _unit(hand - elbow)
        wrist = hand - 0.13 * along
        heel = foot + 0.10 * out * 0.9 - 0.02 * up
        ankle = heel + 0.07 * up - 0.02 * out
        middle = 0.5 * (shoulder + elbow)
        rows += [
            (shoulder, middle, 0.057 * w, 0.052 * w, _SHIRT),
            (middle, elbow, 0.05 * w, 0.043 * w, arms),
            (elbow, wrist, 0.045 * w, 0.029 * w, arms),
            (wrist, hand - 0.05 * along, 0.03, 0.038, _SKIN),
            (hand - 0.06 * along, hand, 0.034, 0.02, _SKIN),
            (pelvis, knee, 0.088 * w, 0.06 * w, _TROUSERS),
            (knee, 0.6 * knee + 0.4 * ankle, 0.058 * w, 0.058 * w, calves),
            (0.6 * knee + 0.4 * ankle, ankle, 0.055 * w, 0.04 * w, calves),
            (heel, foot, 0.042, 0.034, _SHOES),
            (ankle, heel, 0.042, 0.042, _SHOES),
        ]
    parts = np.array([[*begin, *end, first, last] for begin, end, first, last, _ in rows])
    return parts, clothes.colours[[row[4] for row in rows]]


def draw_body(
    picture: NDArray[np.float32],
    camera: Camera,
    cam_from_world: Floats,
    parts: Floats,
    colours: Floats,
    light: float,
) -> NDArray[np.bool_]:
    """Draw a body into a linear (H, W, 3) picture, in place; return its (H, W) pixels.

    Parameters
    ----------
    camera : without distortion. light : radiance of a white surface that faces the lamps.
    """
    pixels = _body_box(camera, cam_from_world, parts)
    drawn = np.zeros(picture.shape[:2], np.bool_)
    if pixels is None:
        return drawn
    x0, y0, x1, y1 = pixels
    rotation = np.ascontiguousarray(cam_from_world[:, :3])
    centre = -rotation.T @ cam_from_world[:, 3]
    _trace(
        picture, drawn, np.array([x0, y0, x1, y1]),
        np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
        rotation, centre, parts, colours, light,
    )  # fmt: skip
    return drawn


def _body_box(camera: Camera, pose: Floats, parts: Floats) -> tuple[int, int, int, int] | None:
    """Return the box of pixels that a body may cover, None outside the picture."""
    ends = parts[:, :6].reshape(-1, 3)
    seen = camera.project(ends @ pose[:, :3].T + pose[:, 3])
    if not np.isfinite(seen).all():
        return None
    depth = (ends @ pose[:, :3].T + pose[:, 3])[:, 2].min()
    margin = 0.2 * camera.fx / max(float(depth), 0.3)
    low = np.maximum(np.floor(seen.min(axis=0) - margin), 0)
    high = np.minimum(np.ceil(seen.max(axis=0) + margin), [camera.width, camera.height])
    if (high <= low).any():
        return None
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


@kernel
def _distance(x, y, z, parts):  # type: ignore[no-untyped-def]
    """Return the distance of a place from the body, m, and the nearest part."""
    total, nearest, part = 1e9, 1e9, 0
    for k in range(len(parts)):
        ax, ay, az = parts[k, 0], parts[k, 1], parts[k, 2]
        bx, by, bz = parts[k, 3] - ax, parts[k, 4] - ay, parts[k, 5] - az
        px, py, pz = x - ax, y - ay, z - az
        length = bx * bx + by * by + bz * bz
        share = min(max((px * bx + py * by + pz * bz) / max(length, 1e-12), 0.0), 1.0)
        dx, dy, dz = px - share * bx, py - share * by, pz - share * bz
        radius = parts[k, 6] + share * (parts[k, 7] - parts[k, 6])
        one = np.sqrt(dx * dx + dy * dy + dz * dz) - radius
        if one < nearest:
            nearest, part = one, k
        mixed = max(_BLEND - abs(total - one), 0.0) / _BLEND
        total = min(total, one) - mixed * mixed * _BLEND * 0.25
    return total, part


@kernel
def _trace(picture, drawn, box, lens, rotation, centre, parts, colours, light):  # type: ignore[no-untyped-def]
    for row in range(box[1], box[3]):
        for column in range(box[0], box[2]):
            u = (column + 0.5 - lens[2]) / lens[0]
            v = (row + 0.5 - lens[3]) / lens[1]
            wx = rotation[0, 0] * u + rotation[1, 0] * v + rotation[2, 0]
            wy = rotation[0, 1] * u + rotation[1, 1] * v + rotation[2, 1]
            wz = rotation[0, 2] * u + rotation[1, 2] * v + rotation[2, 2]
            norm = np.sqrt(wx * wx + wy * wy + wz * wz)
            wx, wy, wz = wx / norm, wy / norm, wz / norm
            along, part, gap = 0.3, 0, 1.0
            for _ in range(_STEPS):
                gap, part = _distance(
                    centre[0] + along * wx, centre[1] + along * wy, centre[2] + along * wz, parts
                )
                along += gap
                if gap < _NEAR or along > 40:
                    break
            if gap >= _NEAR:
                continue
            x, y, z = centre[0] + along * wx, centre[1] + along * wy, centre[2] + along * wz
            e = 0.002
            nx = _distance(x + e, y, z, parts)[0] - _distance(x - e, y, z, parts)[0]
            ny = _distance(x, y + e, z, parts)[0] - _distance(x, y - e, z, parts)[0]
            nz = _distance(x, y, z + e, parts)[0] - _distance(x, y, z - e, parts)[0]
            norm = np.sqrt(nx * nx + ny * ny + nz * nz) + 1e-12
            nx, ny, nz = nx / norm, ny / norm, nz / norm
            facing = -(nx * wx + ny * wy + nz * wz)
            open_ = min(
                max(_distance(x + 0.08 * nx, y + 0.08 * ny, z + 0.08 * nz, parts)[0] / 0.08, 0.25),
                1.0,
            )
            grain = 0.92 + 0.08 * np.sin(310 * x + 5 * np.sin(90 * z)) * np.sin(270 * z + 40 * y)
            bright = light * open_ * grain * (0.22 + 0.5 * max(nz, 0.0) + 0.28 * max(facing, 0.0))
            for k in range(3):
                picture[row, column, k] = colours[part, k] * bright
            drawn[row, column] = True
