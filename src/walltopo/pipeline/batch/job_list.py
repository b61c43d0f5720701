"""Read the list of a batch: TOML, CSV, or one line per scan.

    [[scan]]                          photos,out,reference        photos/north  scans/north
    photos = "photos/north"           photos/north,scans/north,   photos/south  scans/south
    out = "scans/north"
    settings = ["lift.threshold=0.4"]

Paths are relative to the folder of the list.
"""

from __future__ import annotations

import csv
import io
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core import InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.files import read_toml
from walltopo.core.text_files import as_utf8
from walltopo.pipeline.batch.job import ScanJob

_MAX_BYTES = 16 << 20
_COLUMNS = ("photos", "out", "reference", "config", "settings")


class _Row(msgspec.Struct, forbid_unknown_fields=True):
    """A scan as written in a list."""

    photos: str | list[str]
    out: str
    reference: str = ""
    config: str = ""
    settings: list[str] = msgspec.field(default_factory=list)


def is_url(place: str) -> bool:
    """Return whether a place is a URL of an object store, such as s3://bucket/photos."""
    return "://" in place


def read_list(path: Path) -> list[ScanJob]:
    """Return the scans of a list, in order.

    Raises
    ------
    InputError : the list cannot be read, has an unknown column or no scan, or two scans conflict.
    """
    rows = list(_rows(path))
    if not rows:
        raise InputError(
            f"{path}: holds no scans", "Each scan needs its photos and its scan folder."
        )
    jobs = [_job(row, path, origin) for origin, row in rows]
    _check_conflicts(jobs, [origin for origin, _ in rows])
    return jobs


def _rows(path: Path) -> Iterator[tuple[str, _Row]]:
    if path.suffix.lower() == ".toml":
        yield from _toml_rows(path)
        return
    text = _text(path)
    if path.suffix.lower() == ".csv":
        yield from _csv_rows(path, text)
    else:
        yield from _word_rows(path, text)


def _toml_rows(path: Path) -> Iterator[tuple[str, _Row]]:
    table = read_toml(path)
    unknown = set(table) - {"scan"}
    if unknown or not isinstance(table.get("scan", []), list):
        raise InputError(f"{path}: expected [[scan]] tables, got {', '.join(sorted(table))}")
    for number, values in enumerate(table.get("scan", []), start=1):
        origin = f"{path}: scan {number}"
        yield origin, _row(origin, values)


def _csv_rows(path: Path, text: str) -> Iterator[tuple[str, _Row]]:
    reader = csv.DictReader(io.StringIO(text), strict=True)
    try:
        names = reader.fieldnames or ()
        if not {"photos", "out"} <= set(names) <= set(_COLUMNS):
            raise InputError(
                f"{path}: expected the columns photos and out, and perhaps "
                f"{', '.join(_COLUMNS[2:])}; got {', '.join(names) or 'none'}"
            )
        for values in reader:
            origin = f"{path}: line {reader.line_num}"
            if None in values or None in values.values():
                raise InputError(f"{origin}: expected {len(names)} columns")
            given: dict[str, Any] = dict(values)
            given["settings"] = _words(origin, given.get("settings", ""))
            yield origin, _row(origin, given)
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num}: {error}") from error


def _word_rows(path: Path, text: str) -> Iterator[tuple[str, _Row]]:
    for number, line in enumerate(text.splitlines(), start=1):
        origin = f"{path}: line {number}"
        words = _words(origin, line)
        if not words:
            continue
        if len(words) != 2:
            raise InputError(
                f"{origin}: expected the photos and the scan folder, got {len(words)} words",
                "Put quotes around names with spaces; references and settings go into a CSV or "
                "TOML list.",
            )
        yield origin, _Row(photos=words[0], out=words[1])


def _words(origin: str, line: str) -> list[str]:
    try:
        return shlex.split(line, comments=True)
    except ValueError as error:
        raise InputError(f"{origin}: {error}") from error


def _row(origin: str, values: object) -> _Row:
    try:
        return msgspec.convert(values, _Row)
    except msgspec.ValidationError as error:
        raise InputError(f"{origin}: {error}") from error


def _text(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            content = stream.read(_MAX_BYTES + 1)
        if len(content) > _MAX_BYTES:
            raise InputError(f"{path}: larger than {_MAX_BYTES >> 20} MB, not a list of scans")
        with prefix_errors(path):
            return as_utf8(content).decode()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not text in UTF-8") from error


def _job(row: _Row, path: Path, origin: str) -> ScanJob:
    photos = [row.photos] if isinstance(row.photos, str) else row.photos
    if not photos or not all(photos) or not row.out:
        raise InputError(f"{origin}: needs its photos and its scan folder")
    if len(photos) > 1 and any(map(is_url, photos)):
        raise InputError(f"{origin}: expected one URL of photos, got {len(photos)} places")
    home = path.absolute().parent
    return ScanJob(
        photos=tuple(_resolve_path(home, photo) for photo in photos),
        out=_resolve_path(home, row.out),
        reference=_resolve_path(home, row.reference),
        config=_resolve_path(home, row.config),
        settings=tuple(row.settings),
    )


def _resolve_path(home: Path, given: str) -> str:
    """Return an absolute path relative to the list's folder; URLs and "" stay."""
    return given if not given or is_url(given) else str(home / given)


def _check_conflicts(jobs: Sequence[ScanJob], origin: Sequence[str]) -> None:
    """Raise InputError if two scans share an output folder, or one is another's reference."""
    outputs: dict[str, str] = {}
    for job, place in zip(jobs, origin, strict=True):
        out = _canonical(job.out)
        if out in outputs:
            raise InputError(f"{place}: {job.out} is the scan folder of {outputs[out]}, too")
        outputs[out] = place
    for job, place in zip(jobs, origin, strict=True):
        if job.reference and _canonical(job.reference) in outputs:
            raise InputError(
                f"{place}: its reference {job.reference} is made by the same list",
                "Scan the references by a list of their own, first.",
            )


def _canonical(place: str) -> str:
    return place.rstrip("/") if is_url(place) else str(Path(place).resolve())
