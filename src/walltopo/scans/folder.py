"""The scan folder: where each of its files lies."""

from __future__ import annotations

from pathlib import Path

__all__ = ["ScanFolder", "owning_scan"]


class ScanFolder:
    """Paths of one scan; see `docs/scan-folder.md` for what each file holds."""

    def __init__(self, root: Path | str) -> None:
        self.root = Path(root)

    def __repr__(self) -> str:
        return f"ScanFolder({str(self.root)!r})"

    @property
    def manifest(self) -> Path:
        return self.root / "scan.json"

    @property
    def photos(self) -> Path:
        """Upright JPEG photos without personal EXIF, as every later stage reads them."""
        return self.root / "photos"

    @property
    def photo_list(self) -> Path:
        """`photos.json`: per photo its size, focal prior, source; and what was skipped and why."""
        return self.root / "photos.json"

    @property
    def sparse_raw(self) -> Path:
        """The COLMAP model as reconstructed, before `scale` gave it metres and up."""
        return self.root / "work" / "sparse"

    @property
    def aligned(self) -> Path:
        """`work/aligned.json`: the reference that the photos were aligned to; absent without."""
        return self.root / "work" / "aligned.json"

    @property
    def sparse(self) -> Path:
        """The COLMAP model in the world frame."""
        return self.root / "sparse"

    @property
    def scale(self) -> Path:
        """`scale.json`: metric or not, how it was found, residuals."""
        return self.root / "scale.json"

    @property
    def mesh(self) -> Path:
        return self.root / "mesh.ply"

    @property
    def texture(self) -> Path:
        """The texture atlas, PNG."""
        return self.root / "texture.png"

    @property
    def texture_uv(self) -> Path:
        """`texture.npz`: `uv` (F, 3, 2) float32 in [0, 1], origin at the image's top left."""
        return self.root / "texture.npz"

    @property
    def detections(self) -> Path:
        return self.root / "detections.json"

    @property
    def lifted(self) -> Path:
        """`work/instances.npz`: the instances as masks alone tell them, before `propose`."""
        return self.root / "work" / "instances.npz"

    @property
    def lifted_records(self) -> Path:
        """`work/instances.json`: the lift's scores, labels, votes and supporting masks."""
        return self.root / "work" / "instances.json"

    @property
    def instances(self) -> Path:
        return self.root / "instances.npz"

    @property
    def instance_records(self) -> Path:
        """`instances.json`: per instance its score, evidence, label, votes, supporting masks."""
        return self.root / "instances.json"

    @property
    def attributes_raw(self) -> Path:
        """What `classify` found of each instance (colour, type, geometry), before any edit."""
        return self.root / "work" / "attributes.json"

    @property
    def attributes(self) -> Path:
        """`attributes.json`: per hold its colour, type, geometry, with a setter's edits."""
        return self.root / "attributes.json"

    @property
    def light(self) -> Path:
        """What `classify` found of the light in the photos."""
        return self.root / "work" / "light.npz"

    @property
    def cutouts(self) -> Path:
        return self.root / "cutouts"

    @property
    def routes_raw(self) -> Path:
        """The routes as they were found, before any edit."""
        return self.root / "work" / "routes.json"

    @property
    def relabelled(self) -> Path:
        """`relabelled.npz`: triangles whose label edits changed; absent where none."""
        return self.root / "relabelled.npz"

    @property
    def routes(self) -> Path:
        return self.root / "routes.json"

    @property
    def holds(self) -> Path:
        return self.root / "holds.json"

    @property
    def moves(self) -> Path:
        """`moves.json`: how each route may go, by `walltopo moves`; may be absent."""
        return self.root / "moves.json"

    @property
    def moves_script(self) -> Path:
        """The same for a page that is opened from disk, which may not fetch files."""
        return self.root / "moves.js"

    @property
    def glb(self) -> Path:
        return self.root / "wall.glb"

    @property
    def report(self) -> Path:
        return self.root / "report.html"

    @property
    def page(self) -> Path:
        return self.root / "index.html"

    @property
    def page_assets(self) -> Path:
        """`page/`: the viewer's script and the tiers of the wall that `index.html` loads."""
        return self.root / "page"

    @property
    def edits(self) -> Path:
        """`edits.json`: a setter's corrections, replayed on every run; may be absent."""
        return self.root / "edits.json"

    @property
    def route_edits(self) -> Path:
        """`routes.edits.toml`: where corrections were before `edits.json`; may be absent."""
        return self.root / "routes.edits.toml"

    @property
    def hold_edits(self) -> Path:
        """`holds.edits.json`: where corrections were before `edits.json`; may be absent."""
        return self.root / "holds.edits.json"

    @property
    def work(self) -> Path:
        """Intermediate files that can be deleted at any time."""
        return self.root / "work"


# What of a scan folder is the scan's own; other files (an evaluation, a palette) may lie there.
_OWN = {
    getattr(ScanFolder(Path()), name).parts[0]
    for name, member in vars(ScanFolder).items()
    if isinstance(member, property)
} | {".lock"}


def owning_scan(path: Path) -> ScanFolder | None:
    """The scan folder that `path` is, or of whose own files it is one or lies in one; or None."""
    path = path.absolute()
    for root in (path, *path.parents):
        scan = ScanFolder(root)
        if scan.manifest.is_file() and (root == path or path.relative_to(root).parts[0] in _OWN):
            return scan
    return None
