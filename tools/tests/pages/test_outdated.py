"""The README's figures are measured with the code of today, or the check names the record."""

from __future__ import annotations

import subprocess
from pathlib import Path

import msgspec
import pytest
from tools.pages.outdated import outdated
from tools.pages.records import RESULTS, Measured, Record


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository whose README cites the record `speed`, which depends on `fast.py`."""
    _git(tmp_path, "init", "-q")
    (tmp_path / RESULTS).mkdir(parents=True)
    (tmp_path / "fast.py").write_text("")
    (tmp_path / "README.md").write_text('It takes [3 s](docs/results/speed.json "takes").\n')
    _commit(tmp_path)
    revision = _git(tmp_path, "rev-parse", "--short=7", "HEAD").strip()
    record = Record(
        command="python fast.py",
        on="two cores",
        measured=Measured("2026-12-01", "0.2.0", f"{revision}+"),
        output=("takes 3 s",),
        code=("fast.py",),
    )
    record.save(tmp_path / RESULTS / "speed.json")
    _commit(tmp_path)
    return tmp_path


def test_a_record_of_unchanged_code_is_current(repository: Path) -> None:
    (repository / "other.py").write_text("")
    _commit(repository)
    assert list(outdated(repository)) == []


def test_a_change_of_the_code_makes_its_record_outdated(repository: Path) -> None:
    (repository / "fast.py").write_text("import time\n")
    _commit(repository)
    (sentence,) = outdated(repository)
    assert "speed.json: commits that changed its code after 2026-12-01: 1" in sentence


def test_a_record_names_its_code(repository: Path) -> None:
    _replace(repository, code=())
    (sentence,) = outdated(repository)
    assert "names no code" in sentence


def test_code_that_is_gone_and_a_commit_that_is_unknown_are_named(repository: Path) -> None:
    _replace(repository, code=("gone.py",), measured=Measured("2026-12-01", "0.2.0", "0000000"))
    gone, unknown = outdated(repository)
    assert "gone.py: no such file" in gone
    assert "fetch the whole history" in unknown


def _replace(repository: Path, **changes: object) -> None:
    path = repository / RESULTS / "speed.json"
    msgspec.structs.replace(Record.load(path), **changes).save(path)


def _commit(folder: Path) -> None:
    _git(folder, "add", "-A")
    _git(folder, "-c", "user.name=t", "-c", "user.email=t@t", "commit", "-q", "-m", "change")


def _git(folder: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout
