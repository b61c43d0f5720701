"""Pictures of labelled sets."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.core.errors import naming
from walltopo.imaging.opening import open_picture

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["opened_picture"]


@contextmanager
def opened_picture(source: Path | bytes, name: object) -> Iterator[Image]:
    """A picture, not decoded yet.

    Parameters
    ----------
    source : a file, or the bytes of one.
    name : what messages call it.

    Raises
    ------
    InputError : as `open_picture`, with the name; in the block as well.
    """
    with naming(name), open_picture(source) as image:
        yield image
