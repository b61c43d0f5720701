"""Messages of the editor: the result of a log, the status of a rebuild, photos of a place."""

from __future__ import annotations

import msgspec

from walltopo.editing.notes import Note
from walltopo.scans.document import Coordinate
from walltopo.scans.edits import Place
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route


class ShownHold(HoldRow, frozen=True):
    """A row of `holds.json`, or an instance that is none.

    Parameters
    ----------
    left_out : why it is no hold; empty for holds.
    cutout : its picture, as a `data:` address, where an edit had it read in photos anew.
    """

    left_out: str = ""
    cutout: str = ""


class Region(msgspec.Struct, frozen=True):
    """A ball of the surface in which labels may differ from those that the page was made with.

    Parameters
    ----------
    at : its centre, metres, world frame; radius_m : of the ball.
    centroids : base64 of (n, 3) float32, little-endian: all triangles of the mesh that lie in it.
    labels : base64 of (n,) int32, little-endian: what they belong to now, 0 = wall.
    """

    at: Place
    radius_m: Coordinate
    centroids: str
    labels: str


class Surface(msgspec.Struct, frozen=True):
    """The places where labels may differ; a triangle elsewhere is as it was."""

    regions: tuple[Region, ...]


class EditResult(msgspec.Struct, frozen=True):
    """The scan after a log of edits.

    Parameters
    ----------
    holds : in the order of ids, those that are left out among them.
    routes : from left to right, made ones last.
    surface : None where all triangles are as the page was made with.
    notes : what could not be applied, and why.
    """

    holds: tuple[ShownHold, ...]
    routes: tuple[Route, ...]
    surface: Surface | None
    notes: tuple[Note, ...]


class RebuildStatus(msgspec.Struct, frozen=True):
    """How far the files that follow from the log are made.

    Parameters
    ----------
    stale : the scan's files do not show the saved log.
    running : the files are being made.
    done_version : version of the log that the files show; empty where unknown.
    problem : why the files could not be made, in English; empty otherwise.
    key : `problem_key` of the problem, for a page in another language; empty where it has none.
    """

    stale: bool
    running: bool
    done_version: str
    problem: str
    key: str = ""


class Crop(msgspec.Struct, frozen=True):
    """A place of the wall in a photo.

    Parameters
    ----------
    photo : its name.
    picture : as a `data:` address.
    x, y : the place, as shares of the picture's width and height.
    """

    photo: str
    picture: str
    x: float
    y: float
