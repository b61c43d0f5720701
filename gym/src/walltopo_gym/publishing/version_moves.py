"""Suggested moves of published versions, as their public file has them."""

from __future__ import annotations

from functools import lru_cache

import msgspec

from walltopo.scans.moves import ClimberRow, Moves
from walltopo_gym.scans.artifacts import MOVES_FILE
from walltopo_gym.scans.models import Scan
from walltopo_gym.storage.files import FileStore


def suggested_climbers(store: FileStore, scan: Scan, number: int) -> tuple[ClimberRow, ...]:
    """Return the climbers of a version's route; empty before its moves are computed.

    Parameters
    ----------
    number : of the route in the version.
    """
    if MOVES_FILE not in scan.files:
        return ()
    moves = _moves_file(store, scan.files[MOVES_FILE]["key"])
    return next((one.climbers for one in moves.routes if one.route == number), ())


@lru_cache(maxsize=16)
def _moves_file(store: FileStore, key: str) -> Moves:
    """Return the content of a `moves.json`, whose key is the hash of its content."""
    return msgspec.json.decode(store.read(key), type=Moves)
