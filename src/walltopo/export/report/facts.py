"""What the report tells, read from the scan folder."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from walltopo.core import View, WalltopoError
from walltopo.scans.folder import ScanFolder
from walltopo.core.files import read_json

__all__ = ["Facts", "read_facts"]


@dataclass(frozen=True, eq=False)
class Facts:
    """Photos, stages and scale of one scan.

    Parameters
    ----------
    photos : entries of `photos.json`.
    skipped : source and reason of what ingest left out.
    views : registered photos, by name; empty where there is no model.
    unregistered : photo name to the reason ("" where none is known).
    stages : stage name to its entry in `scan.json`.
    scale : `scale.json`.
    cutouts : instance id to the file of its best cutout.
    left_out : instances that were too doubtful to be holds, the surest first.
    """

    photos: list[dict[str, Any]]
    skipped: list[dict[str, Any]]
    views: list[View]
    unregistered: dict[str, str]
    stages: dict[str, dict[str, Any]]
    scale: dict[str, Any]
    cutouts: dict[int, str] = field(default_factory=dict[int, str])
    left_out: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])

    def metric(self, stage: str, key: str) -> Any:
        """One figure of a stage, or None."""
        return self.stages.get(stage, {}).get("metrics", {}).get(key)


def _optional(path: Any, default: Any) -> Any:
    return read_json(path) if path.is_file() else default


def _views(scan: ScanFolder) -> list[View]:
    from walltopo.scans.model import read_views

    if not scan.sparse.is_dir():
        return []
    try:
        return read_views(scan.sparse)
    except WalltopoError:
        # A lift of one's own mesh may come without a model; the report then has no camera part.
        return []


def _cutouts(scan: ScanFolder) -> dict[int, str]:
    """Hold id to the file of its best cutout."""
    best: dict[int, str] = {}
    index = _optional(scan.cutouts / "index.json", [])
    entries = index.get("cutouts", []) if isinstance(index, dict) else index
    for entry in entries:
        best.setdefault(int(entry["id"]), str(entry["file"]))
    return best


def read_facts(scan: ScanFolder) -> Facts:
    """Read what there is; a part that is missing stays empty and the report says so."""
    listing = _optional(scan.photo_list, {"photos": [], "skipped": []})
    views = _views(scan)
    stages = _optional(scan.manifest, {}).get("stages", {})
    reasons = stages.get("sparse", {}).get("metrics", {}).get("unregistered", {})
    reasons = reasons if isinstance(reasons, dict) else dict.fromkeys(reasons, "")
    known = {view.name for view in views}
    missing = [photo["name"] for photo in listing["photos"] if photo["name"] not in known]
    return Facts(
        photos=listing["photos"],
        skipped=listing["skipped"],
        views=views,
        unregistered={name: str(reasons.get(name, "")) for name in missing} if views else {},
        stages=stages,
        scale=_optional(scan.scale, {}),
        cutouts=_cutouts(scan),
        left_out=_optional(scan.attributes, {}).get("left_out", []),
    )
