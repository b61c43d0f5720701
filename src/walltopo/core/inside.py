"""Names of files that come from data, joined to a folder that they must not leave."""

from __future__ import annotations

import ntpath
from pathlib import Path, PurePosixPath

from walltopo.core.errors import InputError

__all__ = ["check_name", "join_inside"]


def check_name(name: str) -> str:
    """A relative name such as `a.jpg` or `cam1/a.jpg`, as it was given.

    Raises
    ------
    InputError : it is empty, absolute (also by Windows' rules), has `..` in it, or a character
        that no file name has.
    """
    parts = PurePosixPath(name.replace("\\", "/")).parts
    if not parts:
        raise InputError("a file without a name")
    if name.startswith(("/", "\\")) or ntpath.splitdrive(name)[0] or ".." in parts:
        raise InputError(f"{name!r} leads out of its folder; expected a relative name without ..")
    if any(ord(letter) < 32 or ord(letter) == 127 for letter in name) or _no_text(name):
        raise InputError(f"{name!r} is no file name: it has a control character")
    if max(len(part.encode()) for part in parts) > 255:
        raise InputError(f"{name[:40]!r}... is no file name: it is longer than 255 bytes")
    return name


def _no_text(name: str) -> bool:
    """Whether a half of a surrogate pair is in it."""
    return any(0xD800 <= ord(letter) < 0xE000 for letter in name)


def join_inside(root: Path, name: str) -> Path:
    """`root / name` for a name that a data file gave: every such path is made here.

    A link within `root` that leads out of it is followed for the file itself (folders of links to
    photos are common, and renaming over a link replaces the link), never for a folder on the way.

    Raises
    ------
    InputError : see `check_name`; or a folder on the way is a link that leads out of `root`.
    """
    path = root / check_name(name)
    if not path.parent.resolve().is_relative_to(root.resolve()):
        raise InputError(f"{name!r} leads out of {root} by a link")
    return path
