"""A file that only looks like a backup is refused in words, before any of it is used."""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import lzma
import random
import sqlite3
import tarfile
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import pytest
from gym.tests.worlds import World, new_database
from hypothesis import given
from hypothesis import strategies as st

from walltopo.cli import main
from walltopo.core import InputError
from walltopo_gym.operating.backup import restore
from walltopo_gym.operating.backup_entries import check_backup
from walltopo_gym.settings import load_settings
from walltopo_gym.storage.files import open_store

_TABLES = "database.sqlite"


def made(entries: Sequence[tuple[tarfile.TarInfo | str, bytes]]) -> bytes:
    """Return a tar with these entries, and a list of contents that agrees with them."""
    out = io.BytesIO()
    hashes: dict[str, str] = {}
    with tarfile.open(fileobj=out, mode="w") as tar:
        for named, content in entries:
            entry = tarfile.TarInfo(named) if isinstance(named, str) else named
            if entry.isfile():
                entry.size = len(content)
                hashes[entry.name] = hashlib.sha256(content).hexdigest()
            tar.addfile(entry, io.BytesIO(content))
        listed = json.dumps({"hashes": hashes}).encode()
        last = tarfile.TarInfo("contents.json")
        last.size = len(listed)
        tar.addfile(last, io.BytesIO(listed))
    return out.getvalue()


def special(kind: bytes, target: str = "") -> tarfile.TarInfo:
    """Return an entry that is not a plain file."""
    entry = tarfile.TarInfo("files/photos/a")
    entry.type, entry.linkname = kind, target
    return entry


def tables() -> bytes:
    """Return a database that has the versions' table."""
    with closing(sqlite3.connect(":memory:")) as made:
        made.execute("CREATE TABLE alembic_version (version_num TEXT)")
        return made.serialize()


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """An empty data folder in a folder of its own."""
    return tmp_path / "place" / "data"


def refused(file: Path, data: Path) -> None:
    """Check that restoring a file is bad input, and that it leaves nothing anywhere."""
    before = sorted(path for path in file.parent.iterdir() if path != data.parent)
    assert main(["gym", "restore", str(file), "--data", str(data)]) == 3
    settings = load_settings({"data": data}, {})
    assert open_store(settings).keys("") == []
    assert {path.name for path in data.iterdir()} <= {"files", "gym.sqlite"}
    assert sorted(path for path in file.parent.iterdir() if path != data.parent) == before
    assert [path.name for path in data.parent.iterdir()] == ["data"]


@pytest.mark.parametrize(
    "name",
    [
        "files/..",
        "files/../x",
        "files/a/../../x",
        "files/.",
        "files/./a",
        "files/",
        "files",
        "files//a",
        "/files/a",
        "/etc/passwd",
        "../out",
        "..",
        ".",
        "files/a/",
        "other",
        "files/a\nb",
        "files/a\x1b[2J",
        "files/a#1",
        f"files/{'x' * 251}",
        f"files/{'ä' * 126}",
        f"files/{'a/' * 600}b",
        "database.sqlite/a",
        "gym.toml/..",
        "FILES/a",
        "files\\a",
        "files/\udcff",
    ],
    ids=ascii,
)
def test_a_name_that_no_backup_has_is_refused(name: str, elsewhere: Path, tmp_path: Path) -> None:
    file = tmp_path / "gym.tar"
    file.write_bytes(made([(_TABLES, tables()), (name, b"a file")]))
    refused(file, elsewhere)


@pytest.mark.parametrize(
    "entries",
    [
        [(special(tarfile.SYMTYPE, "/etc/passwd"), b"")],
        [(special(tarfile.LNKTYPE, _TABLES), b"")],
        [(special(tarfile.CHRTYPE), b"")],
        [(special(tarfile.BLKTYPE), b"")],
        [(special(tarfile.FIFOTYPE), b"")],
        [(special(tarfile.DIRTYPE), b"")],
        [(special(tarfile.CONTTYPE), b"")],
        [(special(b"Z"), b"")],
        [("files/a", b"one"), ("files/a", b"two")],
        [("files/a", b"one"), ("files/a", b"one")],
        [(_TABLES, b"another")],
        [("contents.json", b'{"hashes": {}}')],
        [("files/a", b"one"), ("files/a/b", b"two")],
        [("files/a/b/c", b"one"), ("files/a", b"two")],
    ],
    ids=[
        "symlink",
        "link",
        "character",
        "block",
        "fifo",
        "folder",
        "contiguous",
        "unknown",
        "twice",
        "twice alike",
        "two databases",
        "two lists",
        "in a file",
        "around a file",
    ],
)
def test_entries_that_no_backup_has_are_refused(
    entries: list[tuple[tarfile.TarInfo | str, bytes]], elsewhere: Path, tmp_path: Path
) -> None:
    file = tmp_path / "gym.tar"
    file.write_bytes(made([(_TABLES, tables()), *entries]))
    refused(file, elsewhere)


def test_a_sparse_entry_is_refused(elsewhere: Path, tmp_path: Path) -> None:
    """A few bytes would be terabytes of zeros."""
    entry = tarfile.TarInfo("files/a")
    entry.pax_headers = {"GNU.sparse.map": "0,1", "GNU.sparse.size": str(10**13)}
    file = tmp_path / "gym.tar"
    file.write_bytes(made([(_TABLES, tables()), (entry, b"1")]))
    refused(file, elsewhere)


@pytest.mark.parametrize("size", [-512, -1536, -(2**40)])
def test_an_entry_of_negative_size_is_refused(size: int, elsewhere: Path, tmp_path: Path) -> None:
    """`tarfile` of Python 3.11 reads the same entry again and again (CVE-2025-8194)."""
    entry = tarfile.TarInfo("files/a")
    entry.size = size
    block = entry.tobuf(tarfile.GNU_FORMAT)
    file = tmp_path / "gym.tar"

    file.write_bytes(block + made([(_TABLES, tables())]))
    refused(file, elsewhere)


@pytest.mark.parametrize("content", [b"no database", b"", b"SQLite format 3\0" + bytes(500)])
def test_a_database_that_is_none_is_refused(
    content: bytes, elsewhere: Path, tmp_path: Path
) -> None:
    file = tmp_path / "gym.tar"
    file.write_bytes(made([(_TABLES, content), ("files/a", b"one")]))
    refused(file, elsewhere)


@pytest.mark.both_databases("each has a file format of its own")
def test_a_database_of_other_content_is_refused(
    world: World, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    url = ""
    if world.server.settings.database:
        url = new_database(request.getfixturevalue("postgres"))
    there = load_settings({"data": tmp_path / "there", "database": url}, {})
    name = "database.pgdump" if url else _TABLES
    file = tmp_path / "gym.tar"
    file.write_bytes(made([(name, b"PGDMP" + bytes(99)), ("files/a", b"one")]))
    with pytest.raises(InputError, match="database"):
        restore(there, open_store(there), file)
    assert open_store(there).keys("") == []


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A small backup, as a program would compress it or not."""
    long = tarfile.TarInfo(f"files/{'n' * 120}/{'m' * 120}")
    return made(
        [(_TABLES, tables()), ("files/photos/a", b"one"), (long, b"two"), ("gym.toml", b"")]
    )


@given(st.sampled_from(["tar", "gz", "xz"]), st.integers(0, 2**32), st.booleans())
def test_any_damage_is_refused_in_words(
    tmp_path_factory: pytest.TempPathFactory, whole: bytes, packed: str, seed: int, cut: bool
) -> None:
    content = {"tar": whole, "gz": gzip.compress(whole), "xz": lzma.compress(whole)}[packed]
    chance = random.Random(seed)
    damaged = bytearray(content)
    # Headers more often than content, which is mostly zeros.
    for _ in range(chance.randint(1, 8)):
        at = chance.randrange(len(damaged))
        if packed == "tar" and chance.random() < 0.7:
            at = at // 512 * 512 + chance.choice((0, 124, 135, 148, 156, 157, 257, 345))
        damaged[at] = chance.choice((0, 0x80, 0xFF, ord("L"), ord("x"), chance.randrange(256)))
    if cut:
        del damaged[chance.randrange(len(damaged)) :]
    file = tmp_path_factory.mktemp("damaged") / "gym.tar"
    file.write_bytes(damaged)
    try:
        check_backup(file, _TABLES)
    except InputError:
        return
    with tarfile.open(file) as tar:  # the damage did not matter
        assert set(tar.getnames()) >= {_TABLES, "files/photos/a", "contents.json"}


def test_many_headers_in_headers_are_refused(elsewhere: Path, tmp_path: Path) -> None:
    entry = tarfile.TarInfo("././@LongLink")
    entry.type, entry.size = tarfile.GNUTYPE_LONGNAME, 1
    file = tmp_path / "gym.tar"
    file.write_bytes((entry.tobuf() + b"a".ljust(512, b"\0")) * 5000 + made([]))
    refused(file, elsewhere)
