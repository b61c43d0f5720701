"""The scan folder: each of its files, with type and path (`docs/scan-folder.md`)."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import msgspec

from walltopo.core.files import atomic_path, hash_path
from walltopo.geometry.mesh_files import read_mesh, write_ply
from walltopo.scans.artifacts import Artifact, artifact, load_bundle, of, optional_artifact
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.detections import Detections
from walltopo.scans.edits import EditLog
from walltopo.scans.hidden import HiddenPlaces
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords, InstanceTable, Relabelled
from walltopo.scans.joined import Joined
from walltopo.scans.manifest import Manifest
from walltopo.scans.moves import Moves
from walltopo.scans.photos import PhotoList, PhotoSet, SourceList
from walltopo.scans.pictures import Cutouts, Made, SceneLight, TextureImage, TextureUv
from walltopo.scans.poses import GivenPoses, PosesFit
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Aligned, Scale


class ScanFolder:
    """One scan on disk; each attribute is a path, and on the class the artifact itself."""

    # The user's files of the scan; the runner writes the list before `ingest`.
    sources = artifact(SourceList, "sources.json", "", SourceList.fingerprint)
    # The poses of `sparse.poses`; the runner writes them before `ingest`.
    poses = optional_artifact(GivenPoses, "poses.json")
    # Upright JPEG photos without personal EXIF, and the list of photos and skipped files.
    photos = artifact(PhotoSet, "photos", "ingest")
    photo_list = artifact(PhotoList, "photos.json", "ingest")
    # The COLMAP model as reconstructed, before `scale` sets unit and orientation.
    sparse_raw = artifact(SparseModel, "work/sparse", "sparse")
    # The alignment of the photos to a reference; absent without one.
    aligned = optional_artifact(Aligned, "work/aligned.json", "sparse")
    # How the model agrees with given poses, in whose frame it is; absent without any.
    poses_fit = optional_artifact(PosesFit, "work/poses-fit.json", "sparse")
    sparse = artifact(SparseModel, "sparse", "scale")
    scale = artifact(Scale, "scale.json", "scale")
    mesh = Artifact("mesh.ply", "dense", read_mesh, write_ply)
    # The texture that came with a ready mesh; absent without one.
    given_texture = optional_artifact(TextureImage, "work/given-texture.png", "dense")
    given_uv = optional_artifact(TextureUv, "work/given-texture.npz", "dense")
    texture = artifact(TextureImage, "texture.png", "texture")
    # (F, 3, 2) float32 in [0, 1], origin at the image's top left.
    texture_uv = artifact(TextureUv, "texture.npz", "texture")
    detections = artifact(Detections, "detections.json", "detect")
    # Instances from masks alone, before `propose`; and their scores, labels, votes and masks.
    lifted = artifact(InstanceTable, "work/instances.npz", "lift")
    lifted_records = artifact(InstanceRecords, "work/instances.json", "lift")
    instances = artifact(InstanceTable, "instances.npz", "propose")
    instance_records = artifact(InstanceRecords, "instances.json", "propose")
    # Colour, type and geometry of each instance before any edit; the light of the photos.
    holds_raw = artifact(Holds, "work/holds.json", "classify")
    light = artifact(SceneLight, "work/light.npz", "classify")
    cutouts = artifact(Cutouts, "cutouts", "classify")
    routes_raw = artifact(Routes, "work/routes.json", "routes")
    # A partial rescan: what it replaced of its reference, and the reference's edits that still
    # apply; absent in other scans.
    joined = optional_artifact(Joined, "joined.json", "join")
    carried = optional_artifact(EditLog, "work/carried-edits.json", "join")
    routes = artifact(Routes, "routes.json", "edit")
    holds = artifact(Holds, "holds.json", "edit")
    # Triangles whose label an edit changed; absent without any.
    relabelled = optional_artifact(Relabelled, "relabelled.npz", "edit")
    # Places that a setter hid in texture and photos; absent without any.
    hidden = optional_artifact(HiddenPlaces, "hidden.json", "edit")
    glb = artifact(Made, "wall.glb", "export")
    report = artifact(Made, "report.html", "export")
    page = artifact(Made, "index.html", "export")
    # The viewer's script and the tiers of the wall that `index.html` loads.
    page_assets = artifact(Made, "page", "export")
    # Written by `walltopo moves`; the script is for pages opened from disk.
    moves = optional_artifact(Moves, "moves.json")
    moves_script = optional_artifact(Made, "moves.js")
    # A setter's corrections, replayed on every run; until the first save those of `carried`.
    edits = optional_artifact(EditLog, "edits.json")

    def __init__(self, root: Path | str) -> None:
        self.root = Path(root)

    def __repr__(self) -> str:
        return f"ScanFolder({str(self.root)!r})"

    @property
    def manifest(self) -> Path:
        """Return the path of `scan.json`: settings, and the records of all stages."""
        return self.root / "scan.json"

    @property
    def part(self) -> ScanFolder:
        """Return the scan of the photos of a partial rescan alone, before it is joined."""
        return ScanFolder(self.root / "part")

    @property
    def work(self) -> Path:
        """Return the folder of intermediate files, which can be deleted at any time."""
        return self.root / "work"


ARTIFACTS: tuple[Artifact[object], ...] = tuple(
    member for member in vars(ScanFolder).values() if isinstance(member, Artifact)
)
# Top-level names that belong to the scan; a user may keep other files (a palette) beside them.
_OWN = {Path(item.path).parts[0] for item in ARTIFACTS} | {"scan.json", "work", "part", ".lock"}


def owning_scan(path: Path) -> ScanFolder | None:
    """Return the scan folder at `path`, or the one to which the file `path` belongs, or None."""
    path = path.absolute()
    for root in (path, *path.parents):
        scan = ScanFolder(root)
        if scan.manifest.is_file() and (root == path or path.relative_to(root).parts[0] in _OWN):
            return scan
    return None


def world_frame(scan: ScanFolder) -> str:
    """Return the identity of a scan's world frame; "" if an old version did not record it.

    A scan with its own frame is identified by the content of its model: a new measurement changes
    the frame, although the folder keeps its name. A scan that was registered into a reference has
    the reference's frame.

    Raises
    ------
    InputError : `scale.json` is missing or damaged.
    """
    return frame_of(Scale.load(scan.scale), SparseModel(scan.sparse))


def frame_of(scale: Scale, sparse: SparseModel) -> str:
    """Return the identity of a world frame, as `world_frame`, from the scan's scale and cameras."""
    return scale.reference_frame if scale.method == "reference" else hash_path(sparse.folder)


def read_joined(scan: ScanFolder) -> Joined | None:
    """Return what a partial rescan replaced of its reference; None for other scans.

    Raises
    ------
    InputError : `joined.json` or `scan.json` is damaged.
    """
    return ScanFolder.joined.load(scan) or Manifest.load(scan.manifest).joined


@dataclass(frozen=True, eq=False)
class LogFiles:
    """The edit logs of a scan."""

    edits: EditLog | None = of(ScanFolder.edits)
    carried: EditLog | None = of(ScanFolder.carried)

    @property
    def log(self) -> EditLog:
        """Return the log that counts: the saved one, else the one carried from a reference."""
        return self.edits or self.carried or EditLog()


def read_edits(scan: ScanFolder) -> EditLog:
    """Return the edit log of a scan that counts.

    Raises
    ------
    InputError : a file is damaged.
    """
    return load_bundle(scan, LogFiles).log


def write_moves(folder: ScanFolder, moves: Moves) -> None:
    """Write `moves.json`, and the same as a script, because pages on disk cannot fetch files."""
    moves.save(folder.moves)
    # JSON is valid JavaScript; the ids and numbers here contain nothing that ends a script.
    text = json.dumps(msgspec.to_builtins(moves, str_keys=True))
    with atomic_path(folder.moves_script) as temporary:
        temporary.write_text(f"window.wallTopoMoves={text};\n", encoding="utf-8")
