"""Write `attempt.json`: the contacts of an attempt, and its moves for the figure on the wall."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from walltopo.scans.attempt import AttemptFile, ContactRow, FilmedMove, Rest
from walltopo.scans.moves import moves_basis
from walltopo_climb.beta.clip import ClipReading
from walltopo_climb.beta.contacts import Contact
from walltopo_climb.beta.in_view import Floats, Frames
from walltopo_climb.beta.scanned_wall import ScannedWall
from walltopo_climb.movement.sequence import LIMBS

_REST_S: Final = 5.0  # without a hand's move
_HIPS_OUT: Final = 0.3  # m, of the hips before the wall


def attempt_file(reading: ClipReading, wall: ScannedWall, clip: str) -> AttemptFile:
    """Return the file of an attempt.

    Parameters
    ----------
    clip : file name of the clip.
    """
    attempt, times = reading.attempt, reading.frames.times
    moves = tuple(_list_moves(reading, wall))
    by_id = {hold.id: hold for hold in wall.holds}
    held = [by_id[c.hold] for c in attempt.contacts if c.limb < 2 and c.hold in by_id]
    return AttemptFile(
        clip=clip,
        length=float(times[-1] - times[0]),
        unit=wall.unit,
        made_for=moves_basis(wall.holds, wall.routes),
        route=attempt.route,
        foreign=attempt.foreign,
        start=attempt.start,
        top=attempt.top,
        fall=attempt.fall,
        highest=max(held, key=lambda hold: hold.position[2]).id if held else 0,
        moves=moves,
        rests=tuple(_find_rests(moves)),
        contacts=tuple(
            ContactRow(LIMBS[c.limb], c.hold, c.begin, c.end, c.confidence)
            for c in attempt.contacts
        ),
    )


def _list_moves(reading: ClipReading, wall: ScannedWall) -> list[FilmedMove]:
    """Return the moves: each contact that begins after the start, in order of time."""
    contacts = reading.attempt.contacts
    moves: list[FilmedMove] = []
    last = [0] * len(LIMBS)
    before = 0.0
    for number, contact in enumerate(contacts):
        holds = [_hold_at(contacts, limb, contact.begin) for limb in range(len(LIMBS))]
        holds[contact.limb] = contact.hold
        if number and holds == last:
            continue
        moves.append(
            FilmedMove(
                limb=LIMBS[contact.limb],
                holds=(holds[0], holds[1], holds[2], holds[3]),
                hip=_hip_at(reading, wall, contact.begin),
                effort=0.0,
                came_from=_hold_before(contacts, contact),
                time=contact.begin,
                duration=contact.begin - before if number else 0.0,
                confidence=contact.confidence,
            )
        )
        last, before = holds, contact.begin
    return moves


def _hold_at(contacts: Sequence[Contact], limb: int, time: float) -> int:
    """Return the hold that a limb is on at a time, 0 for none."""
    held = [c.hold for c in contacts if c.limb == limb and c.begin <= time < c.end]
    return held[-1] if held else 0


def _hold_before(contacts: Sequence[Contact], contact: Contact) -> int:
    """Return the hold that the limb was on before a contact, 0 for none."""
    earlier = [c for c in contacts if c.limb == contact.limb and c.begin < contact.begin]
    return earlier[-1].hold if earlier else 0


def _hip_at(reading: ClipReading, wall: ScannedWall, time: float) -> tuple[float, float, float]:
    """Return the hips' place at a time, scan units: before the nearest hold, on the hips' ray."""
    frames = reading.frames
    frame = int(np.abs(frames.times - time).argmin())
    pixels, depth = frames.project(frame, reading.holds.surface.mean(axis=1))
    away = np.linalg.norm(pixels - frames.hips[frame], axis=1)
    nearest = int(np.nanargmin(np.where(depth > 0, away, np.nan)))
    place = _on_ray(frames, frame, float(depth[nearest]) - _HIPS_OUT) * wall.unit
    return float(place[0]), float(place[1]), float(place[2])


def _on_ray(frames: Frames, frame: int, depth: float) -> Floats:
    """Return the place (3,) m of the hips' pixel at a depth."""
    camera, pose = frames.camera, frames.cam_from_world[frame]
    across, down = (frames.hips[frame] - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    local = np.array([across, down, 1.0]) * max(depth, 0.1)
    return np.asarray(pose[:, :3].T @ (local - pose[:, 3]))


def _find_rests(moves: Sequence[FilmedMove]) -> list[Rest]:
    """Return the times without a hand's move that are long enough for a rest."""
    hands = [move.time for move in moves if move.limb in LIMBS[:2]]
    return [Rest(begin, end) for begin, end in pairwise(hands) if end - begin >= _REST_S]
