"""Photos of entries: re-encoded from their pixels alone, and kept below their gym and inspection,
so that they count for the gym's storage and no other inspection names them."""

from __future__ import annotations

import hashlib
from typing import Final
from uuid import UUID

from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.inspections.models import Inspection
from walltopo_gym.storage.files import FileStore
from walltopo_gym.storage.pictures import encode_picture

BELOW: Final = "inspections/"
_LONGEST: Final = 1280  # pixels of the longer side
_MAX_PHOTOS: Final = 300  # of an inspection


def photo_key(gym: UUID, inspection: UUID, photo: str) -> str:
    """Return the key of a photo in the store of files."""
    return f"{BELOW}{gym}/{inspection}/{photo}.jpg"


def store_photo(store: FileStore, inspection: Inspection, content: bytes) -> str:
    """Store a photo, which an entry then names; return its name, the hash of the stored file.

    Raises
    ------
    RequestError : it is no picture, or too large. TooManyError : others are being decoded.
    ConflictError : the inspection has too many.
    """
    picture = encode_picture(content, _LONGEST, "JPEG")
    photo = hashlib.sha256(picture.content).hexdigest()
    key = photo_key(inspection.gym_id, inspection.id, photo)
    there = store.keys(f"{BELOW}{inspection.gym_id}/{inspection.id}/")
    if key not in there:  # a phone that heard no answer sends it again
        if len(there) >= _MAX_PHOTOS:
            raise ConflictError("inspection-photos", most=_MAX_PHOTOS)
        store.put(key, picture.content)
    return photo


def has_photo(store: FileStore, inspection: Inspection, photo: str) -> bool:
    """Return whether an inspection has a photo."""
    return store.has(photo_key(inspection.gym_id, inspection.id, photo))


def read_photo(store: FileStore, inspection: Inspection, photo: str) -> bytes:
    """Return a photo.

    Raises
    ------
    NotFoundError : the inspection has no such photo.
    """
    if not has_photo(store, inspection, photo):
        raise NotFoundError("not-there-photo")
    return store.read(photo_key(inspection.gym_id, inspection.id, photo))
