"""The scan folder: where each file lies, atomic writes, content hashes."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from walltopo.core.errors import EnvironmentLacksError, InputError

__all__ = ["ScanFolder", "atomic_path", "hash_path", "read_json", "write_json"]


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; rename it over `path` when the block succeeds.

    Works for files and for folders (a folder replaces the old one). On an error or Ctrl-C
    nothing of the temporary remains and what was there before stays as it was.

    Raises
    ------
    EnvironmentLacksError : no space left, or the folder cannot be written.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        holder = Path(tempfile.mkdtemp(prefix=".partial-", dir=path.parent))
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {path.parent}: {error.strerror}") from error
    temporary = holder / path.name
    try:
        yield temporary
        if temporary.is_dir() and path.exists():
            # A folder cannot be renamed over a full one: step the old one aside first.
            path.rename(holder / "old")
        temporary.replace(path)
    except OSError as error:
        if error.errno in (28, 122):  # ENOSPC, EDQUOT
            raise EnvironmentLacksError(
                f"no space left while writing {path}", "Free some disk space and run again."
            ) from error
        raise
    finally:
        shutil.rmtree(holder, ignore_errors=True)


def write_json(path: Path, value: Any) -> None:
    """Write `value` as JSON, atomically; NaN is refused because JSON has none."""
    with atomic_path(path) as temporary:
        text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path) -> Any:
    """Read JSON.

    Raises
    ------
    InputError : the file is missing or is not JSON; names the file.
    """
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid JSON ({error})") from error


def hash_path(path: Path) -> str:
    """Content hash of a file, or of all files in a folder (names included); '' if absent."""
    path = Path(path)
    digest = hashlib.blake2b(digest_size=16)
    if path.is_file():
        with path.open("rb") as stream:
            while chunk := stream.read(1 << 20):
                digest.update(chunk)
    elif path.is_dir():
        for item in sorted(p for p in path.rglob("*") if p.is_file()):
            digest.update(os.fsencode(str(item.relative_to(path))))
            digest.update(hash_path(item).encode())
    else:
        return ""
    return digest.hexdigest()


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
    def instances(self) -> Path:
        return self.root / "instances.npz"

    @property
    def instance_records(self) -> Path:
        """`instances.json`: per instance its score, label, votes and supporting masks."""
        return self.root / "instances.json"

    @property
    def attributes(self) -> Path:
        """`attributes.json`: per instance what `classify` found (colour, type, geometry)."""
        return self.root / "attributes.json"

    @property
    def cutouts(self) -> Path:
        return self.root / "cutouts"

    @property
    def routes(self) -> Path:
        return self.root / "routes.json"

    @property
    def holds(self) -> Path:
        return self.root / "holds.json"

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
    def route_edits(self) -> Path:
        """`routes.edits.toml`: a setter's corrections, applied on every run; may be absent."""
        return self.root / "routes.edits.toml"

    @property
    def hold_edits(self) -> Path:
        """`holds.edits.json`: corrections of single holds, applied on every run; may be absent."""
        return self.root / "holds.edits.json"

    @property
    def work(self) -> Path:
        """Intermediate files that can be deleted at any time."""
        return self.root / "work"
