"""Settings of the `edit` stage, and what it reads and makes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import Mesh, about, check_settings
from walltopo.scans.attributes import Attributes, RawAttributes
from walltopo.scans.edits import EditLog
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.light import SceneLight
from walltopo.scans.manifest import Metrics
from walltopo.scans.model import SparseModel
from walltopo.scans.old_edits import HoldEdits, RouteEdits
from walltopo.scans.photo_set import PhotoSet
from walltopo.scans.relabelled import Relabelled
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Scale

__all__ = ["EditSettings", "Reads", "Writes"]


@dataclass(frozen=True)
class EditSettings:
    """How corrections are carried out (section `edit`)."""

    photos: Annotated[
        int,
        about("Photos that an added hold is read in: those that see it best", low=1, high=50),
    ] = 5

    def __post_init__(self) -> None:
        check_settings(self, "edit")


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    mesh: Mesh
    scale: Scale
    photos: PhotoSet
    sparse: SparseModel
    instances: InstanceTable
    instance_records: InstanceRecords
    attributes_raw: RawAttributes
    light: SceneLight
    routes_raw: Routes
    edits: EditLog | None
    hold_edits: HoldEdits
    route_edits: RouteEdits


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    attributes: Attributes
    routes: Routes
    holds: Holds
    relabelled: Relabelled | None
    metrics: Metrics
