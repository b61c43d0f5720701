"""What lies in a scan folder: every artifact by name, with its type and how it is read.

A stage declares the names of what it reads and writes as the fields of two dataclasses (see
`walltopo.pipeline.stages`); who runs it loads and stores them by this table.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walltopo.core import InputError
from walltopo.scans.folder import ScanFolder

__all__ = ["ARTIFACTS", "Artifact", "load_artifact", "store_artifact"]


@dataclass(frozen=True)
class Artifact:
    """One file or folder of a scan; `ScanFolder` has a path of the same name.

    Parameters
    ----------
    type : "module:Class" of the value.
    load : "module:function" of a path that reads it; the class's own `load` where empty.
    save : "module:function" of path and value that writes it; the value's own `save` where empty.
    made_by : the stage that makes it, "" for what a user writes.
    optional : None stands for it where it is absent. What a user writes need not be there either:
        its `load` gives an empty one.
    """

    type: str
    made_by: str
    load: str = ""
    save: str = ""
    optional: bool = False


ARTIFACTS: dict[str, Artifact] = {
    "photos": Artifact("walltopo.scans.photo_set:PhotoSet", "ingest"),
    "photo_list": Artifact("walltopo.scans.photo_list:PhotoList", "ingest"),
    "sparse_raw": Artifact("walltopo.scans.model:SparseModel", "sparse"),
    "aligned": Artifact("walltopo.scans.aligned:Aligned", "sparse", optional=True),
    "sparse": Artifact("walltopo.scans.model:SparseModel", "scale"),
    "scale": Artifact("walltopo.scans.scale:Scale", "scale"),
    "mesh": Artifact(
        "walltopo.core:Mesh",
        "dense",
        load="walltopo.meshes.ply:read_mesh",
        save="walltopo.meshes.ply:write_ply",
    ),
    "texture": Artifact("walltopo.scans.texture:TextureImage", "texture"),
    "texture_uv": Artifact("walltopo.scans.texture:TextureUv", "texture"),
    "detections": Artifact("walltopo.scans.detections:Detections", "detect"),
    "lifted": Artifact("walltopo.scans.instances:InstanceTable", "lift"),
    "lifted_records": Artifact("walltopo.scans.instances:InstanceRecords", "lift"),
    "instances": Artifact("walltopo.scans.instances:InstanceTable", "propose"),
    "instance_records": Artifact("walltopo.scans.instances:InstanceRecords", "propose"),
    "attributes_raw": Artifact("walltopo.scans.attributes:RawAttributes", "classify"),
    "light": Artifact("walltopo.scans.light:SceneLight", "classify"),
    "cutouts": Artifact("walltopo.scans.cutouts:Cutouts", "classify"),
    "routes_raw": Artifact("walltopo.scans.routes:Routes", "routes"),
    "attributes": Artifact("walltopo.scans.attributes:Attributes", "edit"),
    "routes": Artifact("walltopo.scans.routes:Routes", "edit"),
    "holds": Artifact("walltopo.scans.holds:Holds", "edit"),
    "relabelled": Artifact("walltopo.scans.relabelled:Relabelled", "edit", optional=True),
    "glb": Artifact("walltopo.scans.made:Made", "export"),
    "report": Artifact("walltopo.scans.made:Made", "export"),
    "page": Artifact("walltopo.scans.made:Made", "export"),
    "page_assets": Artifact("walltopo.scans.made:Made", "export"),
    "moves": Artifact("walltopo.scans.moves:Moves", "", optional=True),
    "moves_script": Artifact("walltopo.scans.made:Made", "", optional=True),
    "edits": Artifact("walltopo.scans.edits:EditLog", "", optional=True),
    "hold_edits": Artifact("walltopo.scans.old_edits:HoldEdits", ""),
    "route_edits": Artifact("walltopo.scans.old_edits:RouteEdits", ""),
}


def load_artifact(folder: ScanFolder, name: str) -> Any:
    """The value of an artifact of a scan.

    Raises
    ------
    InputError : it is missing (and not optional) or damaged.
    """
    artifact = ARTIFACTS[name]
    path: Path = getattr(folder, name)
    if not path.exists():
        if artifact.optional:
            return None
        if artifact.made_by:
            raise InputError(
                f"{path}: no such file", f"The stage {artifact.made_by} makes it: run it first."
            )
    load: Callable[[Path], Any] = (
        _named(artifact.load) if artifact.load else _named(artifact.type).load
    )
    return load(path)


def store_artifact(folder: ScanFolder, name: str, value: Any) -> None:
    """Write an artifact, atomically; None (of an optional one) takes it away."""
    artifact = ARTIFACTS[name]
    path: Path = getattr(folder, name)
    if value is None:
        path.unlink(missing_ok=True)
    elif artifact.save:
        _named(artifact.save)(path, value)
    else:
        value.save(path)


def _named(target: str) -> Any:
    module, _, name = target.partition(":")
    return getattr(importlib.import_module(module), name)
