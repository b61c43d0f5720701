"""What a log of edits makes of a scan, as the editor is told."""

from __future__ import annotations

import msgspec

from walltopo.edit.notes import Note
from walltopo.scans.bounds import Coordinate
from walltopo.scans.edits import Place
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route

__all__ = ["Region", "Result", "ShownHold", "Surface"]


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


class Result(msgspec.Struct, frozen=True):
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
