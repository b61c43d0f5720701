"""The entries of a finished inspection as a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from walltopo_gym.spreadsheets import CsvDialect, csv_table

_COLUMNS: Final = ("at", "wall", "item", "hold", "mark", "note", "by", "photo", "counts", "late")


def record_csv(file: dict[str, Any], dialect: CsvDialect) -> str:
    """Return a line for each entry, the first made first.

    `counts` marks the latest entry of an item or hold; late ones are not signed.

    Parameters
    ----------
    file : as `record.record_file` returns it.
    """
    return csv_table(_COLUMNS, _rows(file), dialect)


def _rows(file: dict[str, Any]) -> Iterator[dict[str, object]]:
    record = file["record"]
    walls = {wall["id"]: wall["name"] for wall in record["walls"]}
    latest = {id(entry) for entry in latest_facts(record["entries"])}
    entries = [(entry, False) for entry in record["entries"]]
    for entry, is_late in entries + [(entry, True) for entry in file["late"]]:
        item = entry["item"]
        yield {
            "at": entry["at"],
            "wall": walls.get(entry["wall_id"], ""),
            "item": "" if item is None else record["checklist"][item],
            "hold": entry["hold"],
            "mark": entry["mark"],
            "note": entry["note"],
            "by": entry["by"],
            "photo": entry["photo"] or "",
            "counts": "yes" if id(entry) in latest else "",
            "late": "yes" if is_late else "",
        }


def latest_facts(entries: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the latest entry of each item and hold of each wall of a record."""
    found = {(entry["wall_id"], entry["item"], entry["hold"]): entry for entry in entries}
    return list(found.values())
