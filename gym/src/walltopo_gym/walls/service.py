"""A gym's floor plan: a picture from above, and the walls' places on it."""

from __future__ import annotations

import hashlib
from typing import Final

from walltopo_gym.gyms.models import Gym
from walltopo_gym.storage.files import FileStore
from walltopo_gym.storage.pictures import encode_picture
from walltopo_gym.walls.models import FloorPlan

_LONGEST: Final = 1600  # pixels of the longer side


def key_of(sha256: str) -> str:
    """Return the key of a plan's picture in the store."""
    return f"plans/{sha256}.png"


def store_plan_picture(store: FileStore, gym: Gym, content: bytes) -> FloorPlan:
    """Store a picture as the gym's plan: re-encoded from its pixels.

    Raises
    ------
    RequestError : the format is not supported, or it is too large. TooManyError : others are being
        decoded.
    """
    picture = encode_picture(content, _LONGEST, "PNG")
    sha256 = hashlib.sha256(picture.content).hexdigest()
    store.put(key_of(sha256), picture.content)
    return FloorPlan(gym_id=gym.id, sha256=sha256, width=picture.width, height=picture.height)
