"""Read XML files of other programs."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from walltopo.core import InputError

_MAX_BYTES = 200_000_000


def read_xml(path: Path) -> ElementTree.Element:
    """Return the root of an XML file.

    Raises
    ------
    InputError : the file is missing, too large or not XML, or declares entities.
    """
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise InputError(f"{path}: too large for a file of camera poses")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    # Entities that contain each other can fill any memory; no program writes them here.
    if b"<!ENTITY" in data:
        raise InputError(f"{path}: declares entities, which are not read")
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise InputError(f"{path}: not valid XML ({error})") from error
