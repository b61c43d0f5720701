"""Read XML files of other programs."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

from walltopo.core import InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.text_files import as_utf8

_MAX_BYTES = 200_000_000

# The declaration names the encoding that the file had before `as_utf8`.
_DECLARATION = re.compile(rb"^<\?xml.*?\?>", re.DOTALL)


def read_xml(path: Path) -> ElementTree.Element:
    """Return the root of an XML file.

    Raises
    ------
    InputError : the file is missing, too large or not XML, or declares entities.
    """
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise InputError(f"{path}: too large for a file of camera poses")
        stored = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    with prefix_errors(path):
        data = as_utf8(stored)
    if data != stored:
        data = _DECLARATION.sub(b"", data)
    # Entities that contain each other can fill any memory; no program writes them here.
    if b"<!ENTITY" in data:
        raise InputError(f"{path}: declares entities, which are not read")
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise InputError(f"{path}: not valid XML ({error})") from error
