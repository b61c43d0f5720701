"""Photos of a reference beside the new ones: by a link, else by a copy."""

from __future__ import annotations

from pathlib import Path

import pytest

from walltopo.reconstruct.sparse.align import _show_folder


def test_without_links_the_photos_are_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    photos, place = tmp_path / "photos", tmp_path / "both"
    photos.mkdir()
    (photos / "a.jpg").write_bytes(b"1")
    _show_folder(place, photos)
    assert place.is_symlink()

    def refused(*_: object, **__: object) -> None:
        raise OSError(1314, "a required privilege is not held by the client")

    monkeypatch.setattr(Path, "symlink_to", refused)
    for content in (b"2", b"3"):
        (photos / "a.jpg").write_bytes(content)
        _show_folder(place, photos)
        assert not place.is_symlink()
        assert (place / "a.jpg").read_bytes() == content
