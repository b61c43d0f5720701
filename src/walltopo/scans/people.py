"""`photos/people.json`: where people stood in the photos, who are hidden there."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask
from walltopo.core.errors import prefix_errors
from walltopo.core.files import check_name
from walltopo.scans.document import Count, Document, FileName
from walltopo.scans.segmentation import Rle, decode_segmentation, encode_mask

PEOPLE = "people.json"
Bitmap = NDArray[np.bool_]


class HiddenPeople(msgspec.Struct, frozen=True):
    """The people in one photo.

    Parameters
    ----------
    photo : name of the photo; people : number of people found.
    segmentation : their pixels in the photo.
    """

    photo: FileName
    people: Count
    segmentation: Rle

    def __post_init__(self) -> None:
        check_name(self.photo)

    @classmethod
    def of(cls, photo: str, people: int, mask: Bitmap) -> HiddenPeople:
        """Return the entry of a photo with the (H, W) pixels of its people."""
        encoded = encode_mask(Mask.from_full(mask, 1))
        return cls(photo, people, msgspec.convert(encoded, Rle))


class PeopleList(Document, frozen=True, kw_only=True):
    """`people.json`: the photos that showed people; the file is absent if none did."""

    photos: tuple[HiddenPeople, ...] = ()

    def mask(self, photo: str) -> Bitmap | None:
        """Return the (H, W) pixels of people in a photo; None for a photo without any.

        Raises
        ------
        InputError : the entry is damaged.
        """
        entry = next((entry for entry in self.photos if entry.photo == photo), None)
        if entry is None:
            return None
        height, width = entry.segmentation.size
        with prefix_errors(f"people.json: {photo}"):
            return decode_segmentation(entry.segmentation, width, height, 1, 1.0).full()
