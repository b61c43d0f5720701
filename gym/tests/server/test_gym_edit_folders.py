"""Folders of open edit sessions: one of each process, deleted after a kill."""

from __future__ import annotations

from pathlib import Path

from walltopo_gym.editing.service import OwnFolder


def test_processes_share_a_data_folder(tmp_path: Path) -> None:
    parent = tmp_path / "editing"
    left = parent / "left-by-a-kill"
    left.mkdir(parents=True)
    first, second = OwnFolder(parent), OwnFolder(parent)
    (first.path() / "scan").mkdir()
    assert not left.exists()
    assert second.path() != first.path()
    assert (first.path() / "scan").is_dir()  # its process lives
    for folder in (first, second):
        folder.close()
    assert list(parent.iterdir()) == []
    OwnFolder(parent).close()  # never needed
