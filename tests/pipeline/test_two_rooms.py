"""Photos of two rooms in one folder: the larger one is scanned, the others are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from walltopo.cli import main
from walltopo.core.files import read_json


@pytest.mark.slow
def test_the_larger_room_is_kept(
    tiny_photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tiny_photos.parent / "second-room"
    out = tmp_path / "scan"
    # Few photos: a network matches each with each other.
    photos = [*sorted(tiny_photos.glob("*.jpg"))[:6], *sorted(other.glob("*.jpg"))[:3]]
    words = ["scan", *map(str, photos), "-o", str(out), "--to", "sparse"]
    assert main([*words, "--set", "sparse.threads=1"]) == 0
    output = " ".join(capsys.readouterr().out.split())
    metrics = read_json(out / "scan.json")["stages"]["sparse"]["metrics"]
    assert metrics["registered"] == 6
    left_out = set(metrics["unregistered"])
    assert left_out == {f"IMG_{k:04d}_2.jpg" for k in range(3)}
    assert all(f"{name} not registered" in output for name in left_out)
