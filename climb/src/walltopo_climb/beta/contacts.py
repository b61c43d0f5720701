"""The holds that each limb is on over time, by one dynamic programme per limb (Viterbi, 1967).

The states of a limb are the holds near its path, the bare wall (feet alone) and the air. A hold
explains a limb that is within its outline and slow; the air explains all else moderately well.
Changing the state costs, so that a hold counts from about .3 s on and a single wrong frame changes
nothing: no frame is decided by itself. A limb that is not seen says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from walltopo_climb.beta.in_view import (
    LIMBS,
    Floats,
    Frames,
    Observations,
    WallHolds,
    observe,
    runs_of,
)

WALL: Final = 0  # the id of a contact with the bare wall or a volume's plain side

_NEAR_M: Final = 0.3  # a hold that a limb never comes so close to is no state
_SIGMA_M: Final = (0.07, 0.07, 0.08, 0.08)  # error of a limb's point, hands and feet
_SIGMA_SPEED: Final = 0.5  # m/s, of a limb that holds on, with the jitter of the pose
_WRONG: Final = 0.03  # share of frames whose point is wrong: a hand taken for an elbow
_AIR: Final = -1.5  # log-likelihood of the air at any distance
_BARE_WALL: Final = -2.6  # of a foot on the wall: a hold within reach explains it better
_VOLUME: Final = 1.0  # less for a volume than for a hold upon it
_SWITCH: Final = 4.5  # cost of beginning or ending a contact
_DIRECT: Final = 8.0  # cost of a change from hold to hold without air between
_FRAME_S: Final = 0.1  # a likelihood is that of so much time
_IMPOSSIBLE: Final = -1e6
_SEEN: Final = 0.3  # confidence from which a point makes a hold a candidate


@dataclass(frozen=True)
class Contact:
    """A limb on a hold.

    Parameters
    ----------
    limb : index, as in `movement.sequence.LIMBS`. hold : its id; `WALL` for the bare wall.
    begin, end : s. confidence : in [0, 1], of this hold against the next best explanation.
    """

    limb: int
    hold: int
    begin: float
    end: float
    confidence: float


def find_contacts(
    frames: Frames, holds: WallHolds, observations: Observations | None = None
) -> tuple[Contact, ...]:
    """Return the contacts of all limbs in order of their begin.

    Parameters
    ----------
    observations : of these frames and holds, if they are known already.
    """
    seen = observe(frames, holds) if observations is None else observations
    weights = frames.confidence * _frame_weights(frames.times)[:, None]
    found: list[Contact] = []
    for limb in range(LIMBS):
        near = (seen.distance[:, limb] < _NEAR_M) & (frames.confidence[:, limb, None] > _SEEN)
        chosen = np.flatnonzero(near.any(axis=0))
        scores = _log_likelihoods(seen.distance[:, limb, chosen], seen.speed[:, limb, chosen], limb)
        scores[:, 2:] -= _VOLUME * holds.is_volume[chosen]
        states = _best_states(scores * weights[:, limb, None])
        ids = np.array([-1, WALL, *holds.ids[chosen]])
        found += _contacts_of(limb, states, ids, scores, frames.times)
    return tuple(sorted(found, key=lambda contact: (contact.begin, contact.limb)))


def _frame_weights(times: Floats) -> Floats:
    """Return the weight of each frame: as much evidence a second at any frame rate."""
    return np.clip(np.gradient(times) / _FRAME_S, 0.0, 1.0)


def _log_likelihoods(distance: Floats, speed: Floats, limb: int) -> Floats:
    """Return log-likelihoods of the states.

    Parameters
    ----------
    distance, speed : (F, N) of the candidate holds.

    Returns
    -------
    (F, 2 + N): air, wall, holds. The wall is impossible for hands.
    """
    n = len(distance)
    # Relative to which hold a limb moves matters little for the air: the nearest one.
    nearest = distance.argmin(axis=1)[:, None] if distance.shape[1] else None
    own = np.zeros((n, 1)) if nearest is None else np.take_along_axis(speed, nearest, axis=1)
    slow = np.exp(-0.5 * (own / _SIGMA_SPEED) ** 2)
    air = _AIR + np.log(1.1 - slow)
    is_foot = limb >= LIMBS // 2
    wall = _BARE_WALL + np.log(_WRONG + slow) if is_foot else np.full((n, 1), _IMPOSSIBLE)
    off = (distance / _SIGMA_M[limb]) ** 2 + (speed / _SIGMA_SPEED) ** 2
    return np.concatenate([air, wall, np.log(_WRONG + np.exp(-0.5 * off))], axis=1)


def _best_states(scores: Floats) -> npt.NDArray[np.int64]:
    """Return the sequence of states with the greatest sum of scores less the costs of changes.

    Parameters
    ----------
    scores : (F, S), state 0 is the air.
    """
    frames, count = scores.shape
    best = scores[0] - _SWITCH * (np.arange(count) > 0)
    came = np.zeros((frames, count), np.int64)
    for frame in range(1, frames):
        top = int(best.argmax())
        stay = best.copy()
        direct = best[top] - _DIRECT
        through_air = best[0] - _SWITCH
        # Into the air from anywhere; onto a hold from the air, or at a higher cost directly.
        choices = np.stack([stay, np.full(count, through_air), np.full(count, direct)])
        choices[1, 0], choices[2, 0] = -np.inf, best[top] - _SWITCH
        which = choices.argmax(axis=0)
        came[frame] = np.where(which == 0, np.arange(count), np.where(which == 1, 0, top))
        best = choices.max(axis=0) + scores[frame]
    states = np.empty(frames, np.int64)
    states[-1] = int(best.argmax())
    for frame in range(frames - 1, 0, -1):
        states[frame - 1] = came[frame, states[frame]]
    return states


def _contacts_of(
    limb: int,
    states: npt.NDArray[np.int64],
    ids: npt.NDArray[np.int64],
    scores: Floats,
    times: Floats,
) -> list[Contact]:
    """Return the runs of equal states, without those in the air."""
    found = []
    for begin, end in runs_of(states):
        state = int(states[begin])
        if state == 0:
            continue
        last = min(end, len(times) - 1)
        rest = np.delete(scores[begin:end], state, axis=1).max(axis=1)
        margin = float(np.mean(scores[begin:end, state] - rest))
        confidence = float(1.0 / (1.0 + np.exp(-margin)))
        found.append(
            Contact(limb, int(ids[state]), float(times[begin]), float(times[last]), confidence)
        )
    return found
