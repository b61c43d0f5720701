"""The scan folder: each of its files, with its type and place (`docs/scan-folder.md`)."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec

from walltopo.core.files import atomic_path, hash_path
from walltopo.geometry.ply import read_mesh, write_ply
from walltopo.scans.artifacts import Artifact, artifact, optional_artifact
from walltopo.scans.attributes import Attributes, RawAttributes
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.detections import Detections
from walltopo.scans.edits import EditLog
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords, InstanceTable, Relabelled
from walltopo.scans.light import SceneLight
from walltopo.scans.moves import Moves
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.scans.pictures import Cutouts, Made, TextureImage, TextureUv
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Aligned, Scale
from walltopo.scans.sources import SourceList


class ScanFolder:
    """One scan on disk; each attribute is a path, and on the class the artifact itself."""

    # The user's files that the scan is made from; the runner writes it before `ingest`.
    sources = artifact(SourceList, "sources.json", "", SourceList.fingerprint)
    # Upright JPEG photos without personal EXIF, and the list of them and of what was left out.
    photos = artifact(PhotoSet, "photos", "ingest")
    photo_list = artifact(PhotoList, "photos.json", "ingest")
    # The COLMAP model as reconstructed, before `scale` gives it metres and up.
    sparse_raw = artifact(SparseModel, "work/sparse", "sparse")
    # The reference that the photos were aligned to; absent without one.
    aligned = optional_artifact(Aligned, "work/aligned.json", "sparse")
    sparse = artifact(SparseModel, "sparse", "scale")
    scale = artifact(Scale, "scale.json", "scale")
    mesh = Artifact("mesh.ply", "dense", read_mesh, write_ply)
    texture = artifact(TextureImage, "texture.png", "texture")
    # (F, 3, 2) float32 in [0, 1], origin at the image's top left.
    texture_uv = artifact(TextureUv, "texture.npz", "texture")
    detections = artifact(Detections, "detections.json", "detect")
    # Instances by masks alone, before `propose`; and their scores, labels, votes and masks.
    lifted = artifact(InstanceTable, "work/instances.npz", "lift")
    lifted_records = artifact(InstanceRecords, "work/instances.json", "lift")
    instances = artifact(InstanceTable, "instances.npz", "propose")
    instance_records = artifact(InstanceRecords, "instances.json", "propose")
    # Colour, type and geometry of each instance before any edit; the light of the photos.
    attributes_raw = artifact(RawAttributes, "work/attributes.json", "classify")
    light = artifact(SceneLight, "work/light.npz", "classify")
    cutouts = artifact(Cutouts, "cutouts", "classify")
    routes_raw = artifact(Routes, "work/routes.json", "routes")
    attributes = artifact(Attributes, "attributes.json", "edit")
    routes = artifact(Routes, "routes.json", "edit")
    holds = artifact(Holds, "holds.json", "edit")
    # Triangles whose label edits changed; absent where none did.
    relabelled = optional_artifact(Relabelled, "relabelled.npz", "edit")
    glb = artifact(Made, "wall.glb", "export")
    report = artifact(Made, "report.html", "export")
    page = artifact(Made, "index.html", "export")
    # The viewer's script and the tiers of the wall that `index.html` loads.
    page_assets = artifact(Made, "page", "export")
    # Written by `walltopo moves`; the script is for a page that is opened from disk.
    moves = optional_artifact(Moves, "moves.json")
    moves_script = optional_artifact(Made, "moves.js")
    # A setter's corrections, replayed on every run.
    edits = optional_artifact(EditLog, "edits.json")

    def __init__(self, root: Path | str) -> None:
        self.root = Path(root)

    def __repr__(self) -> str:
        return f"ScanFolder({str(self.root)!r})"

    @property
    def manifest(self) -> Path:
        """`scan.json`: settings, and how each stage went."""
        return self.root / "scan.json"

    @property
    def work(self) -> Path:
        """Intermediate files that can be deleted at any time."""
        return self.root / "work"


ARTIFACTS: tuple[Artifact[object], ...] = tuple(
    member for member in vars(ScanFolder).values() if isinstance(member, Artifact)
)
# Top-level names that belong to the scan; a user may keep other files (a palette) beside them.
_OWN = {Path(item.path).parts[0] for item in ARTIFACTS} | {"scan.json", "work", ".lock"}


def owning_scan(path: Path) -> ScanFolder | None:
    """Return the scan folder that `path` is, or one of whose own files it is; else None."""
    path = path.absolute()
    for root in (path, *path.parents):
        scan = ScanFolder(root)
        if scan.manifest.is_file() and (root == path or path.relative_to(root).parts[0] in _OWN):
            return scan
    return None


def world_frame(scan: ScanFolder) -> str:
    """Return what identifies the world frame of a scan; "" where an old walltopo left no note.

    A scan with a frame of its own is identified by the content of its model: measured again it has
    another frame, although its folder keeps its name. A scan that was registered into a reference
    has the reference's frame.

    Raises
    ------
    InputError : its `scale.json` is missing or damaged.
    """
    scale = Scale.load(scan.scale)
    return scale.reference_frame if scale.method == "reference" else hash_path(scan.sparse)


def write_moves(folder: ScanFolder, moves: Moves) -> None:
    """Write `moves.json`, and the same as a script: pages opened from disk may not fetch files."""
    moves.save(folder.moves)
    # JSON is JavaScript but for what would end a script, which hold no names here: ids and numbers.
    text = json.dumps(msgspec.to_builtins(moves, str_keys=True))
    with atomic_path(folder.moves_script) as temporary:
        temporary.write_text(f"window.wallTopoMoves={text};\n", encoding="utf-8")
