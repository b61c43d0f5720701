"""Reading of labelled sets with automatic format detection, and writing in any format."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from walltopo.core import InputError
from walltopo.core.files import atomic_path, join_inside, read_json
from walltopo.core.text_files import first_text
from walltopo_lab.datasets.coco import is_coco, read_coco, write_coco
from walltopo_lab.datasets.labelme import is_labelme, read_labelme, write_labelme
from walltopo_lab.datasets.model import Dataset
from walltopo_lab.datasets.via import is_via, read_via, write_via
from walltopo_lab.datasets.yolo import read_yolo, write_yolo

FORMATS = ("coco", "coco-rle", "yolo", "yolo-seg", "labelme", "labelme-embedded", "via")


def read_dataset(path: Path, photos: Path | None = None) -> Dataset:
    """Read a labelled set; detect its format from the file or folder.

    Parameters
    ----------
    path : a COCO or VIA JSON; a LabelMe JSON or a folder of them; a YOLO folder, its data.yaml,
        or a folder of such folders (`train`, `valid`), whose photos are then merged; or
        a folder with one COCO or VIA JSON in it.
    photos : folder of the photos, if they are not beside the labels.

    Raises
    ------
    InputError : no known format; the message lists the expected ones.
    """
    path = Path(path)
    if path.suffix.lower() in (".yaml", ".yml"):
        path = path.parent
    if path.is_file():
        return _read_json_file(path, photos)
    if not path.is_dir():
        raise InputError(f"{path}: no such file or folder")
    if (path / "labels").is_dir():
        return read_yolo(path)
    parts = [sub for sub in sorted(path.iterdir()) if (sub / "labels").is_dir()]
    if parts:
        return _join_sets([read_yolo(part) for part in parts])
    for file in sorted(path.glob("*.xml")):
        _refuse_other_programs(file)
    files = sorted(path.glob("*.json"))
    whole = [file for file in files if not is_labelme(read_json(file))]
    if len(whole) == 1:
        return _read_json_file(whole[0], photos)
    if files and not whole:
        return read_labelme(path)
    raise InputError(
        f"{path}: no labelled set found here",
        "Known: YOLO (labels/ beside images/), LabelMe (JSON per photo), one COCO or VIA JSON.",
    )


def _refuse_other_programs(path: Path, data: Any = None) -> None:
    """Raise InputError for a native file of a labelling program whose other exports are read.

    Sources: CVAT's "CVAT for images" XML, Label Studio's JSON and JSON-MIN.
    """
    if data is None and "<annotations>" in first_text(path, 4000):
        raise InputError(
            f"{path}: CVAT's own XML is not read",
            "Export the job or task from CVAT as 'COCO 1.0', which has polygons, boxes and masks.",
        )
    first = data[0] if isinstance(data, list) and data else None
    if isinstance(first, dict) and ("annotations" in first or "annotation_id" in first):
        raise InputError(
            f"{path}: Label Studio's own JSON is not read",
            "Export the project from Label Studio as 'COCO' or 'YOLO with Images'.",
        )


def _read_json_file(path: Path, photos: Path | None) -> Dataset:
    if path.suffix.lower() == ".xml":
        _refuse_other_programs(path)
    data = read_json(path)
    _refuse_other_programs(path, data)
    if is_coco(data):
        return read_coco(path, photos)
    if is_labelme(data):
        return read_labelme(path)
    if is_via(data):
        return read_via(path, photos)
    raise InputError(f"{path}: neither COCO nor LabelMe nor VIA")


def _join_sets(parts: list[Dataset]) -> Dataset:
    classes: dict[int, str] = {}
    not_read: Counter[str] = Counter()
    for part in parts:
        classes |= part.classes
        not_read.update(part.not_read)
    return Dataset(tuple(photo for part in parts for photo in part.photos), classes, not_read)


def write_dataset(path: Path, dataset: Dataset, kind: str, *, copy_photos: bool = True) -> None:
    """Write a set in one of `FORMATS` into the folder `path`.

    COCO is written as `annotations.json`, VIA as `via.json`. With `copy_photos` the photos are
    copied (into `images/`, or beside the JSON for LabelMe), so that the set is self-contained.

    Raises
    ------
    InputError : unknown format, or a photo to copy is missing.
    """
    path = Path(path)
    if kind in ("coco", "coco-rle"):
        write_coco(path / "annotations.json", dataset, rle=kind == "coco-rle")
    elif kind in ("yolo", "yolo-seg"):
        write_yolo(path, dataset, segments=kind == "yolo-seg")
    elif kind in ("labelme", "labelme-embedded"):
        write_labelme(path, dataset, embed=kind == "labelme-embedded")
    elif kind == "via":
        write_via(path / "via.json", dataset)
    else:
        raise InputError(f"unknown format {kind!r}; expected one of {', '.join(FORMATS)}")
    if copy_photos:
        copy_pictures(dataset, path if kind.startswith("labelme") else path / "images")


def copy_pictures(dataset: Dataset, folder: Path) -> None:
    """Copy the photos of a set, byte for byte.

    Raises
    ------
    InputError : a photo was not found, or is a symbolic link: a foreign set could link to any
        file of this machine.
    """
    for photo in dataset.photos:
        if photo.path is not None and photo.path.is_symlink():
            raise InputError(
                f"{photo.path}: a link, whose target is not copied",
                "Put the picture itself there (`cp -L`), or leave pictures out (--no-photos).",
            )
        place = join_inside(folder, photo.name)
        if not place.is_file():
            with atomic_path(place) as temporary:
                temporary.write_bytes(photo.content())
