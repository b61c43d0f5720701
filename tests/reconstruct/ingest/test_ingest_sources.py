"""Exactly which files ingest reads, and the reasons for the others; none of them is opened."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from made_files import ingested, skipped_reasons, write_photos  # type: ignore[import-not-found]

from walltopo.core import InputError
from walltopo.reconstruct.ingest.sources import find_sources, shown_name


def test_missing_and_empty_sources(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file or folder"):
        find_sources([tmp_path / "nowhere"])
    with pytest.raises(InputError, match="no photos here"):
        find_sources([tmp_path])


def _socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as bound:
        here = Path.cwd()
        os.chdir(path.parent)  # a socket's address is short
        try:
            bound.bind(path.name)
        finally:
            os.chdir(here)


SPECIAL: dict[str, Callable[[Path], object]] = {
    "a pipe": lambda path: os.mkfifo(path),
    "a socket": _socket,
    "a device": lambda path: path.symlink_to("/dev/zero"),
    "a link to nothing": lambda path: path.symlink_to("nowhere.jpg"),
    "a link that leads in a circle": lambda path: path.symlink_to(path.name),
    "a folder": lambda path: path.mkdir(),
}


@pytest.mark.parametrize("reason", SPECIAL)
def test_what_is_no_file_is_left_out(tmp_path: Path, reason: str) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    SPECIAL[reason](folder / "x.jpg")
    assert skipped_reasons(ingested(tmp_path, folder))["x.jpg"].startswith(reason)
    if reason != "a folder":
        with pytest.raises(InputError, match=f"no photos here\n  x.jpg: {reason}"):
            find_sources([folder / "x.jpg"])


def test_folders_in_the_folder_are_not_looked_into(tmp_path: Path) -> None:
    write_photos(tmp_path / "in")
    write_photos(tmp_path / "in" / "raw")
    found = find_sources([tmp_path / "in"])
    assert [file.parent.name for file in found.files] == ["in"] * 3
    assert [(item.source, item.reason.split(";")[0]) for item in found.skipped] == [
        ("raw", "a folder")
    ]


def test_a_scan_in_the_photo_folder_is_no_source(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    before = find_sources([folder])
    (folder / "wall").mkdir()
    (folder / "wall" / "scan.json").write_text("{}")
    (folder / "wall" / "texture.png").write_bytes((folder / "p0.jpg").read_bytes())
    after = find_sources([folder])
    assert after.files == before.files
    assert [(item.source, item.reason) for item in after.skipped] == [("wall", "a scan folder")]
    with pytest.raises(InputError, match="is a scan folder, not a folder of photos"):
        find_sources([folder / "wall"])


def test_a_scan_is_not_made_from_its_own_photos(tmp_path: Path) -> None:
    write_photos(tmp_path / "in")
    scan = ingested(tmp_path, tmp_path / "in")
    before = {file.name: file.read_bytes() for file in scan.photos.iterdir()}
    with pytest.raises(InputError, match="lies in the scan folder that is written"):
        ingested(tmp_path, scan.photos)
    assert {file.name: file.read_bytes() for file in scan.photos.iterdir()} == before


def test_names_that_are_not_utf8_or_odd_or_long(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder, 5)
    odd = [
        os.fsdecode(b"caf\xe9.jpg"),
        "²³.jpg",  # digits that are no decimals
        "ü" * 125 + ".jpg",  # 254 bytes
        "…" * 84 + ".png",  # 256 bytes would be too many for the folder itself: 255 with .jpg
    ]
    odd[3] = "…" * 83 + "ab.png"  # 255 bytes
    for k, name in enumerate(odd):
        (folder / f"p{k}.jpg").rename(folder / name)
    scan = ingested(tmp_path, folder)
    assert skipped_reasons(scan) == {}
    names = [file.name for file in scan.photos.iterdir()]
    assert len(names) == 5
    assert max(len(name.encode()) for name in names) <= 190
    assert shown_name(folder / odd[0]) == "caf\\xe9.jpg"
    assert "caf\\xe9.jpg" in scan.photo_list.read_text().replace("\\\\", "\\")
