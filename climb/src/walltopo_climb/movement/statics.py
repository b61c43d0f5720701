"""The statics of one stance: can a body hold it, and at what effort (numba)?

A stance is two hands and two feet on holds. Cyclic projection (POCS) finds a hip position within
reach of all four. The force on the hands follows from the balance of moments about the feet. The
cost of holding on is the sum of squared loads over the strength of each hold, as Naderi, Rajamäki
and Hämäläinen (2017, "Discovering and synthesizing humanoid climbing movements", section 5) square
the torques. Steep walls and a distant hip load the hands: Noé, Quaine and Martin (2001).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from walltopo.geometry.kernels import kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

NONE = -1  # a limb on no hold
_ROUNDS = 8  # of projections; a feasible position is found in three or four
_CLEAR = 0.10  # of the height: minimum distance of the hip from the wall
_LOCKED = 0.5  # share of its force that a fully bent arm loses (Kulig, Andrews and Hay 1984)
_SMEAR = 0.3  # share of the weight that shoes carry on a bare vertical wall; an estimate
_MIN = 0.08  # of a jug: minimum strength of any hold in any direction, as fingers find an edge
_CROUCH = 0.16  # of the height: minimum distance of the hip from a foot


@kernel
def place_hip(position: Floats, wall: Floats, limbs: Ints, body: Floats, hip: Floats) -> float:
    """Place the hip for a stance; return the greatest lack of reach (m), 0 if all is in reach.

    Parameters
    ----------
    position, wall : (N, 3) of the holds. limbs : (4,) left hand, right hand, left foot, right
    foot: hold or `NONE`. body : (5,) height, leg, arm, torso, half the shoulders' breadth.
    hip : (3,) output.
    """
    height, leg, arm, torso, half = body[0], body[1], body[2], body[3], body[4]
    far = arm + torso
    count = 0
    nx = ny = nz = 0.0
    px = py = pz = 0.0
    hands = 0
    hx = hy = hz = 0.0
    for k in range(4):
        i = limbs[k]
        if i == NONE:
            continue
        count += 1
        nx += wall[i, 0]
        ny += wall[i, 1]
        nz += wall[i, 2]
        px += position[i, 0]
        py += position[i, 1]
        pz += position[i, 2]
        if k < 2:
            hands += 1
            hx += position[i, 0]
            hy += position[i, 1]
            hz += position[i, 2]
    length = math.sqrt(nx * nx + ny * ny + nz * nz) + 1e-9
    nx, ny, nz = nx / length, ny / length, nz / length
    px, py, pz = px / count, py / count, pz / count
    # Start at the wall, a straight arm below the middle of the hands, where a climber rests.
    drop = 0.85 * far
    x = hx / hands + nx * _CLEAR * height
    y = hy / hands + ny * _CLEAR * height
    z = hz / hands - drop
    for _ in range(_ROUNDS):
        for k in range(4):
            i = limbs[k]
            if i == NONE:
                continue
            dx, dy, dz = x - position[i, 0], y - position[i, 1], z - position[i, 2]
            d = math.sqrt(dx * dx + dy * dy + dz * dz) + 1e-9
            longest = far + 0.5 * half if k < 2 else leg
            shortest = 0.0 if k < 2 else _CROUCH * height
            if d > longest or d < shortest:
                f = (longest if d > longest else shortest) / d
                x, y, z = (
                    position[i, 0] + dx * f,
                    position[i, 1] + dy * f,
                    position[i, 2] + dz * f,
                )
        out = (x - px) * nx + (y - py) * ny + (z - pz) * nz
        if out < _CLEAR * height:
            lack = _CLEAR * height - out
            x, y, z = x + lack * nx, y + lack * ny, z + lack * nz
    hip[0], hip[1], hip[2] = x, y, z
    worst = 0.0
    for k in range(4):
        i = limbs[k]
        if i == NONE:
            continue
        dx, dy, dz = x - position[i, 0], y - position[i, 1], z - position[i, 2]
        d = math.sqrt(dx * dx + dy * dy + dz * dz)
        worst = max(worst, d - (far + 0.5 * half if k < 2 else leg))
    return worst if worst > 0.01 else 0.0


@kernel
def hold_on(
    position: Floats,
    wall: Floats,
    pull: Floats,
    hand: Floats,
    outward: Floats,
    foot: Floats,
    limbs: Ints,
    moving: int,
    hip: Floats,
    body: Floats,
) -> tuple[float, float]:
    """Return the effort of holding on while limb `moving` (0..3; 4: none) bears nothing.

    Forces are shares of the body's weight. Return the effort (sum of squared loads over the
    strength of the holds), and the unbalanced moment that swings the body (a barn door), as a share
    of weight times height.
    """
    # The centre of the feet's push.
    bear = 0.0
    fx = fy = fz = 0.0
    feet = 0
    lean = 0.0
    for k in range(2):
        if limbs[k] != NONE and k != moving:
            lean = wall[limbs[k], 2]
    for k in range(2, 4):
        i = limbs[k]
        if i == NONE or k == moving:
            continue
        feet += 1
        w = foot[i] + 1e-3
        bear += w
        fx += w * position[i, 0]
        fy += w * position[i, 1]
        fz += w * position[i, 2]
    hands = 0
    hx = hy = hz = 0.0
    for k in range(2):
        i = limbs[k]
        if i == NONE or k == moving:
            continue
        hands += 1
        hx += position[i, 0]
        hy += position[i, 1]
        hz += position[i, 2]
    if hands == 0:
        return 1e9, 0.0
    hx, hy, hz = hx / hands, hy / hands, hz / hands
    swing = 0.0
    # Shoes on the bare wall carry some of the weight unless it overhangs.
    load = 1.0 - min(max(_SMEAR + lean, 0.0), 2 * _SMEAR)
    if feet > 0:
        fx, fy, fz = fx / bear, fy / bear, fz / bear
        rx, ry, rz = hx - fx, hy - fy, hz - fz
        span = math.sqrt(rx * rx + ry * ry + rz * rz) + 1e-6
        # Moment of the weight about the feet: (hip - feet) x (0, 0, -1).
        mx, my = -(hip[1] - fy), hip[0] - fx
        along = (mx * rx + my * ry) / span
        across = math.sqrt(max(mx * mx + my * my - along * along, 0.0))
        load = min(max(across / span, 1.0 - bear), 1.5)
        if feet + hands < 3:  # one foot and one hand: nothing stops the swing
            swing = abs(along) / body[0]
    effort = 0.0
    strength = 0.0
    for k in range(2):
        i = limbs[k]
        if i == NONE or k == moving:
            continue
        dx, dy, dz = hip[0] - position[i, 0], hip[1] - position[i, 1], hip[2] - position[i, 2]
        d = math.sqrt(dx * dx + dy * dy + dz * dz) + 1e-9
        off = max((dx * wall[i, 0] + dy * wall[i, 1] + dz * wall[i, 2]) / d, 0.0)
        agree = (dx * pull[i, 0] + dy * pull[i, 1] + dz * pull[i, 2]) / d
        # A hold pulled sideways bears about half, one pulled the wrong way hardly anything.
        turned = max(0.5 + 0.5 * agree, 0.15)
        bent = min(max((body[2] + body[3] - d) / body[2], 0.0), 1.0)
        bears = hand[i] * turned * (1.0 - outward[i] * off) * (1.0 - _LOCKED * bent)
        strength += max(bears, _MIN) ** 2
    # The load is distributed over the hands so that the sum of squares is minimal.
    effort = load * load / strength
    return effort, swing
