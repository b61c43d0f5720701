"""Lists of scans: each form says the same, and what cannot be meant is refused."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import InputError, SettingsError
from walltopo.pipeline.batch.job import ScanJob, settings_of_job
from walltopo.pipeline.batch.job_list import read_list

TOML = """
[[scan]]
photos = "a b"
out = "one"
[[scan]]
photos = ["c"]
out = "two"
"""


def _read(folder: Path, name: str, text: str) -> list[ScanJob]:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_list(path)


def test_each_form_says_the_same(tmp_path: Path) -> None:
    words = _read(tmp_path, "list.txt", '# our walls\n"a b" one\n\nc two  # the new one\n')
    rows = _read(tmp_path, "list.csv", "photos,out\na b,one\nc,two\n")
    tables = _read(tmp_path, "list.toml", TOML)
    assert words == rows == tables
    assert words[0] == ScanJob(photos=(str(tmp_path / "a b"),), out=str(tmp_path / "one"))


def test_own_settings_and_reference(tmp_path: Path) -> None:
    text = "photos,out,reference,settings\nnew,two,one,lift.threshold=0.3 texture.size=512\n"
    (job,) = _read(tmp_path, "list.csv", text)
    settings = settings_of_job(job)
    assert (settings.lift.threshold, settings.texture.size) == (0.3, 512)
    assert settings.sparse.reference == str(tmp_path / "one")
    (job,) = _read(tmp_path, "other.csv", "photos,out,settings\na,b,lift.treshold=1\n")
    with pytest.raises(SettingsError, match="threshold"):
        settings_of_job(job)


@pytest.mark.parametrize(
    ("name", "text", "word"),
    [
        ("a.txt", "photos one\nother ./one\n", "line 2"),
        ("a.txt", "photos\n", "line 1"),
        ("a.txt", "'photos one\n", "quotation"),
        ("a.txt", "", "no scan"),
        ("a.csv", "photos,folder\na,b\n", "columns"),
        ("a.csv", "photos,out\na\n", "line 2"),
        ("a.csv", "photos,out\na,b,c\n", "line 2"),
        ("a.csv", "photos,out\n,b\n", "line 2"),
        ("a.csv", "photos,out,reference\na,b,\nc,d,b\n", "same list"),
        ("a.toml", '[[scan]]\nphotos="a"\nout="b"\nrefernce="c"\n', "scan 1"),
        ("a.toml", '[scans]\nphotos="a"\n', "scan"),
        ("a.toml", '[[scan]]\nphotos=["s3://a/b", "c"]\nout="b"\n', "URL"),
    ],
)
def test_what_cannot_be_meant(tmp_path: Path, name: str, text: str, word: str) -> None:
    with pytest.raises(InputError, match=word):
        _read(tmp_path, name, text)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_list_or_refused(
    tmp_path_factory: pytest.TempPathFactory, raw: bytes
) -> None:
    folder = tmp_path_factory.mktemp("lists")
    for name in ("list.txt", "list.csv", "list.toml"):
        (folder / name).write_bytes(raw)
        with suppress(InputError):
            assert read_list(folder / name)
