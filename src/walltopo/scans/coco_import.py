"""Read COCO files as other programs write them.

pycocotools, CVAT, Label Studio, Roboflow, FiftyOne and X-AnyLabeling agree on COCO's keys but not
on its types. This module rewrites what has one certain meaning into the types of `CocoFile`, and
leaves the rest for its checks to reject.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core import InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.text_files import read_utf8
from walltopo.scans.detections import CocoFile, Detections
from walltopo.scans.document import parse

_REMEDY = "Export COCO with images, annotations (with segmentation) and categories."
Row = dict[str, Any]


def read_coco(path: Path) -> Detections:
    """Return the masks of a COCO file of any program.

    Accepted beyond `Detections.load`: a byte order mark, UTF-16, NaN in keys that are not used, ids
    as text, sizes as 1280.0, `score: null`, a single outline as a flat list, the original names of
    photos that Roboflow renamed, and category ids from 0. If an annotation has a category below 1,
    all labels are moved up so that the lowest is 1, because label 0 means no object.

    Raises
    ------
    InputError : the file is missing or not COCO, or a record is invalid (it is named).
    """
    path = Path(path)
    data = _read_json(path)
    if not isinstance(data, dict) or not isinstance(data.get("images"), list):
        raise InputError(f"{path}: not a COCO file: it has no list of images", _REMEDY)
    with prefix_errors(path):
        plain = _plain_lists(data)
    return Detections.from_coco(parse(plain, CocoFile, str(path)), path)


def read_coco_masks(path: Path) -> tuple[dict[str, Any], dict[int, str]]:
    """Return masks by photo name, and class names by label, of a COCO file of any program."""
    found = read_coco(path)
    return dict(found.masks), dict(found.classes)


def _read_json(path: Path) -> Any:
    """Return the JSON of a file; raise InputError if it is none."""
    content = read_utf8(path)
    try:
        try:
            return msgspec.json.decode(content)
        except msgspec.DecodeError:
            found = json.loads(content)  # which accepts NaN; the checks reject it where it counts
            json.dumps(found, ensure_ascii=False).encode()  # and unpaired surrogates: rejected here
            return found
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not valid JSON ({error})") from error


def _plain_lists(data: Row) -> Row:
    """Return the lists of a COCO file with the types of `CocoFile`."""
    images, annotations, categories = (
        [dict(row) if isinstance(row, dict) else row for row in _list_of(data, name)]
        for name in ("images", "annotations", "categories")
    )
    numbers: dict[str, int] = {}  # of ids that are words

    def number(value: Any) -> Any:
        """Return an id as an integer; words are numbered from -1 downwards."""
        if isinstance(value, float) and value.is_integer():
            return int(value)
        if isinstance(value, str):
            text = value.strip()
            return int(text) if text.isdecimal() else numbers.setdefault(text, -1 - len(numbers))
        return value

    for row in filter(_is_row, images):
        _change(row, number, "id")
        _change(row, _whole_number, "width", "height")
        extra = row.get("extra")
        if isinstance(extra, dict) and ".rf." in str(row.get("file_name")):
            row["file_name"] = extra.get("name", row["file_name"])
    for row in filter(_is_row, categories):
        _change(row, number, "id")
    for row in filter(_is_row, annotations):
        _change(row, _whole_number, "id")
        _change(row, number, "image_id", "category_id")
        _change(row, _outline_list, "segmentation")
        if row.get("score", 0) is None:
            del row["score"]
        row.setdefault("segmentation", [])
    _shift_category_ids(categories, annotations)
    info = data.get("info")
    return {
        "images": images,
        "annotations": annotations,
        "categories": categories,
        "info": info if isinstance(info, dict) else {},
    }


def _list_of(data: Row, name: str) -> list[Any]:
    """Return a list of a COCO file; null and a missing list are empty."""
    rows = data.get(name)
    if isinstance(rows, list) or rows is None:
        return rows or []
    raise InputError(f"expected a list of {name}, got {type(rows).__name__}", _REMEDY)


def _is_row(row: Any) -> bool:
    return isinstance(row, dict)


def _change(row: Row, function: Any, *names: str) -> None:
    for name in names:
        if name in row:
            row[name] = function(row[name])


def _whole_number(value: Any) -> Any:
    """Return 1280.0 as 1280, and other values unchanged."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _outline_list(value: Any) -> Any:
    """Return a flat list of coordinates as one outline, null as none."""
    if value is None:
        return []
    flat = isinstance(value, list) and value and all(isinstance(v, int | float) for v in value)
    return [value] if flat else value


def _shift_category_ids(categories: list[Any], annotations: list[Any]) -> None:
    """Add one to all category ids if an annotation has one below 1."""
    used = [row.get("category_id") for row in annotations if _is_row(row)]
    lowest = min((value for value in used if isinstance(value, int)), default=1)
    if lowest >= 1:
        return
    for rows, key in ((categories, "id"), (annotations, "category_id")):
        for row in filter(_is_row, rows):
            if isinstance(row.get(key), int):
                row[key] += 1 - lowest
