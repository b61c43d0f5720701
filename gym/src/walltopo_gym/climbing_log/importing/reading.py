"""Recognise whose log a file is, and read it."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from typing import Final

from walltopo_gym.climbing_log.importing.documents import read_document
from walltopo_gym.climbing_log.importing.lines import LogFile, LogLine, RawLine, make_line
from walltopo_gym.climbing_log.importing.tables import KINDS, read_rows
from walltopo_gym.errors import RequestError
from walltopo_gym.spreadsheets import Fault

MAX_LINES: Final = 20_000
SOURCES: Final = (
    "8a.nu, theCrag, BoardLib, Aurora (Kilter, Tension), MoonBoard, TopLogger, walltopo"
)


def read_log(text: str) -> LogFile:
    """Return the climbs of an exported log, CSV or JSON.

    Raises
    ------
    RequestError : the text is no log of a known layout, is damaged, or has too many lines.
    """
    if text.lstrip("\ufeff \t\r\n")[:1] in ("{", "["):
        return _read_json(text)
    try:
        names, rows = read_rows(text)
        kind = next((kind for kind in KINDS if kind.needed <= set(names)), None)
        if kind is None:
            raise RequestError("log-unknown", "log-known", names=SOURCES)
        return _log_file(kind.source, (kind.parse(number, cells) for number, cells in rows))
    except csv.Error as error:
        raise RequestError("log-damaged", "log-export-again") from error


def _read_json(text: str) -> LogFile:
    try:
        document = json.loads(text.lstrip("\ufeff"))
    except (ValueError, RecursionError) as error:
        raise RequestError("log-damaged", "log-export-again") from error
    found = read_document(document)
    if found is None:
        raise RequestError("log-unknown", "log-known", names=SOURCES)
    return _log_file(*found)


def _log_file(source: str, raw: Iterable[RawLine]) -> LogFile:
    lines: list[LogLine] = []
    faults: list[Fault] = []
    for each in raw:
        made = make_line(each)
        if isinstance(made, Fault):
            faults.append(made)
        else:
            lines.append(made)
        if len(lines) + len(faults) > MAX_LINES:
            raise RequestError("table-too-long", "table-in-parts", most=MAX_LINES)
    return LogFile(source, lines, faults)
