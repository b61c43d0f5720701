"""`walltopo export` and `walltopo merge`: what they write, and what they leave alone."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from walltopo.cli import main
from walltopo.scans.folder import ScanFolder, world_frame
from walltopo.scans.scale import Scale

MakeScan = Callable[..., ScanFolder]


@pytest.fixture
def scan(make_scan: MakeScan) -> ScanFolder:
    return make_scan("gym", holds=4, cells=24)


def _run(*words: object) -> int:
    return main([str(word) for word in words])


def _bytes(folder: Path) -> dict[str, bytes]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def _register(scan: ScanFolder, frame: str) -> None:
    """Let a scan be one that was registered into a reference."""
    scale = Scale.load(scan.scale)
    msgspec.structs.replace(scale, method="reference", reference_frame=frame).save(scan.scale)


@pytest.fixture
def pair(make_scan: MakeScan) -> tuple[ScanFolder, ScanFolder]:
    old, new = (make_scan(name, holds=4, cells=24) for name in ("old", "new"))
    _register(new, world_frame(old))
    return old, new


@pytest.mark.parametrize("kind", ["labelme", "glb", "obj"])
@pytest.mark.parametrize("overwrite", [[], ["--overwrite"]])
@pytest.mark.parametrize("where", ["", "photos", "photos/new", "scan.json", "mesh.ply", "page/x"])
def test_export_leaves_the_scan_alone(
    scan: ScanFolder, kind: str, overwrite: list[str], where: str
) -> None:
    before = _bytes(scan.root)
    out = scan.root / where
    assert _run("export", scan.root, "--format", kind, "-o", out, *overwrite) == 3
    assert _bytes(scan.root) == before


def test_export_may_write_beside_the_scans_own_files(scan: ScanFolder) -> None:
    assert _run("export", scan.root, "--format", "csv", "-o", scan.root / "holds.csv") == 0


@pytest.mark.parametrize("kind", ["labelme", "csv", "obj"])
def test_export_leaves_foreign_files_alone(
    scan: ScanFolder, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "holiday"
    out.mkdir()
    (out / "a").write_text("mine")
    (out / "wall.jpg").write_text("mine")
    (out / "wall.csv").write_text("mine")
    before = _bytes(out)
    path = out if kind == "labelme" else out / f"wall.{kind}"
    assert _run("export", scan.root, "--format", kind, "-o", path) == 3
    output = " ".join(capsys.readouterr().err.split())
    assert "--overwrite" in output
    assert "another -o" in output
    assert _bytes(out) == before
    assert _run("export", scan.root, "--format", kind, "-o", path, "--overwrite") == 0
    assert (out / "a").read_text() == "mine"


def test_labelme_again_keeps_what_a_user_corrected(scan: ScanFolder, tmp_path: Path) -> None:
    out = tmp_path / "labels"
    assert _run("export", scan.root, "--format", "labelme", "-o", out) == 0
    assert _run("export", scan.root, "--format", "labelme", "-o", out) == 0
    labels = out / "IMG_1.json"
    labels.write_text("corrected")
    assert _run("export", scan.root, "--format", "labelme", "-o", out) == 3
    assert labels.read_text() == "corrected"


def test_export_leaves_devices_and_pipes(scan: ScanFolder, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/null")):
        assert _run("export", scan.root, "--format", "csv", "-o", path, "--overwrite") == 3
        assert not path.is_file()


def test_merge_writes_a_gym_twice(pair: tuple[ScanFolder, ScanFolder], tmp_path: Path) -> None:
    old, new = pair
    out = tmp_path / "joined"
    for _ in range(2):
        assert _run("merge", old.root, new.root, "-o", out) == 0
    assert ScanFolder(out).page.is_file()
    assert ScanFolder(out).routes.is_file()
    assert not list(out.glob(".partial-*"))


def test_merge_leaves_other_folders_alone(
    pair: tuple[ScanFolder, ScanFolder], make_scan: MakeScan, tmp_path: Path
) -> None:
    old, new = pair
    site = tmp_path / "site"
    (site / "page").mkdir(parents=True)
    (site / "index.html").write_text("mine")
    (site / "page" / "viewer.js").write_text("mine")
    third = make_scan("third", holds=4, cells=24).root
    for out in (site, old.root, third, third / "page"):
        before = _bytes(out)
        assert _run("merge", old.root, new.root, "-o", out) == 3
        assert _bytes(out) == before
    assert _run("merge", old.root, new.root, "-o", third, "--overwrite") == 3


@pytest.mark.parametrize("near", ["nan", "inf", "-inf", "-1", "0", "1e300", "9" * 5000])
def test_merge_refuses_impossible_distances(
    pair: tuple[ScanFolder, ScanFolder], near: str, tmp_path: Path
) -> None:
    with pytest.raises(SystemExit) as caught:
        _run("merge", pair[0].root, pair[1].root, "-o", tmp_path / "g", f"--near={near}")
    assert caught.value.code == 2


def test_merge_asks_which_reference(
    make_scan: MakeScan, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("ref", "a", "b", "other")
    ref, a, b, other = (make_scan(name, holds=4, cells=24) for name in names)
    _register(a, world_frame(ref))
    _register(b, world_frame(ref))
    _register(other, "a frame elsewhere")
    out = tmp_path / "out"
    assert _run("merge", a.root, other.root, "-o", out) == 3
    assert "its own frame" in " ".join(capsys.readouterr().err.split())
    assert _run("merge", a.root, b.root, "-o", out) == 0
    # The reference was scanned anew where it lay: what was registered before is in another frame.
    (ref.sparse / "images.txt").write_text("")
    assert _run("merge", ref.root, a.root, "-o", out) == 3
    _register(b, "")
    assert _run("merge", a.root, b.root, "-o", out) == 3
    assert "older version" in " ".join(capsys.readouterr().err.split())
    assert _run("merge", a.root, b.root, "-o", out, "--same-frame") == 0


def test_a_copied_scan_keeps_its_frame(pair: tuple[ScanFolder, ScanFolder], tmp_path: Path) -> None:
    copy = shutil.copytree(pair[0].root, tmp_path / "moved" / "elsewhere")
    assert _run("merge", copy, pair[1].root, "-o", tmp_path / "joined") == 0
