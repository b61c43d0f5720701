"""A classifier of hold cutouts (ONNX): its input image, its classes and their meaning."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import read_toml
from walltopo.images.networks import Network, open_network
from walltopo.scans.document import parse

ROLES = ("hold", "volume", "downclimb")


@dataclass(frozen=True)
class Meaning:
    """The hold attributes that a class implies; "" for an unspecified one.

    Parameters
    ----------
    type : type of the hold.
    colour : colour name, "" if the class does not specify it.
    role : one of `ROLES`.
    """

    type: str
    colour: str = ""
    role: str = "hold"

    def __post_init__(self) -> None:
        if self.role not in ROLES:
            raise InputError(f"role must be one of {', '.join(ROLES)}, got {self.role!r}")


def _default(name: str) -> Meaning:
    return Meaning(name, role=name if name in ROLES else "hold")


class _Row(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The entry of a class in a file; see `Meaning`."""

    type: str | None = None
    colour: str = ""
    role: Literal["hold", "volume", "downclimb"] | None = None

    def meaning(self, name: str) -> Meaning:
        """Return the class's meaning, with defaults from its name for missing fields."""
        default = _default(name)
        type_ = default.type if self.type is None else self.type
        return Meaning(type_, self.colour, self.role or default.role)


class _Class(_Row, frozen=True, kw_only=True):
    name: Annotated[str, msgspec.Meta(min_length=1)]


class _Classes(msgspec.Struct, frozen=True):
    classes: tuple[_Class, ...] = msgspec.field(name="class", default=())


def read_classes(path: Path) -> dict[str, Meaning]:
    """Read a `classes.toml`.

    Raises
    ------
    InputError : the file is missing, is not TOML, or has an invalid entry, which the message names.
    """
    hint = "See docs/colours.md for its format."
    found: dict[str, Meaning] = {}
    for row in parse(read_toml(path, hint), _Classes, str(path)).classes:
        if row.name in found:
            raise InputError(f"{path}: class {row.name!r} is there twice")
        found[row.name] = row.meaning(row.name)
    if not found:
        raise InputError(f"{path}: holds no [[class]] table", "See docs/colours.md.")
    return found


def meanings_of(names: Sequence[str], given: Mapping[str, Meaning]) -> list[Meaning]:
    """Return the meaning of each class of a network: from `given`, else from its name."""
    return [given.get(name) or _default(name) for name in names]


def to_json(meanings: Mapping[str, Meaning]) -> str:
    """Return the meanings as JSON for a network's metadata."""
    return json.dumps({name: asdict(meaning) for name, meaning in meanings.items()})


def meanings_from_json(text: str, path: Path) -> dict[str, Meaning]:
    """Parse the JSON that `to_json` wrote into the network at `path`."""
    try:
        rows = msgspec.json.decode(text, type=dict[str, _Row])
    except (msgspec.DecodeError, RecursionError) as error:
        raise InputError(f"{path}: metadata classes: cannot be read ({error})") from error
    return {name: row.meaning(name) for name, row in rows.items()}


GREY = 114  # background around the hold

FILLED = 0.9  # share of the side covered by the hold's longest extent


def square_cutout(crop: NDArray[np.uint8], mask: NDArray[np.bool_], side: int) -> NDArray[np.uint8]:
    """Return (side, side, 3) uint8: the masked pixels, scaled to fit and centred on grey.

    Parameters
    ----------
    crop : (h, w, 3) uint8 RGB; mask : (h, w) bool, at least one pixel.

    Raises
    ------
    InputError : the mask is empty or of another shape.
    """
    import cv2

    if crop.shape[:2] != mask.shape:
        raise InputError(f"cutout: crop of {crop.shape[:2]}, but mask of {mask.shape}")
    rows, columns = np.nonzero(mask)
    if len(rows) == 0:
        raise InputError("cutout: the mask is empty")
    box = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
    cover = mask[box].astype(np.float32)
    factor = FILLED * side / max(cover.shape)
    size = (max(1, round(cover.shape[1] * factor)), max(1, round(cover.shape[0] * factor)))
    method = cv2.INTER_AREA if factor < 1 else cv2.INTER_LINEAR
    inner = cv2.resize(np.ascontiguousarray(crop[box]), size, interpolation=method)
    share = cv2.resize(cover, size, interpolation=method)[..., None]
    canvas = np.full((side, side, 3), GREY, np.uint8)
    top, left = (side - size[1]) // 2, (side - size[0]) // 2
    blended = inner * share + GREY * (1 - share)
    canvas[top : top + size[1], left : left + size[0]] = np.round(blended)
    return canvas


Floats = NDArray[np.float64]

DEFAULT_SIDE = 224  # for a network with dynamic input size and no `side` in its metadata

BATCH = 64


@dataclass(frozen=True)
class Verdict:
    """A classifier's result for one hold.

    Parameters
    ----------
    name : the class.
    confidence : margin to the second class times the weighted share of the cutouts that agree.
    """

    name: str
    confidence: float


@dataclass(frozen=True, eq=False)
class CutoutClassifier:
    """A loaded classifier network.

    Parameters
    ----------
    network : the ONNX network.
    names : its classes; meanings : the implied hold attributes of each, in the same order.
    side : side of its input images, pixels.
    certain : minimum reliable confidence; 0 if the file does not specify one.
    """

    network: Network
    names: tuple[str, ...]
    meanings: tuple[Meaning, ...]
    side: int
    certain: float = 0.0

    def confidences(self, pictures: NDArray[np.uint8]) -> Floats:
        """Return (n, classes) in [0, 1], rows sum to 1, for (n, side, side, 3) uint8 RGB images."""
        session = self.network.session
        fixed = self.network.input_shape[0] == 1
        step = 1 if fixed else BATCH
        rows = [np.zeros((0, len(self.names)))]
        for first in range(0, len(pictures), step):
            block = pictures[first : first + step].transpose(0, 3, 1, 2)
            feed = np.ascontiguousarray(block, dtype=np.float32) / 255.0
            answer = session.run(None, {session.get_inputs()[0].name: feed})[0]
            if answer.shape != (len(block), len(self.names)):
                raise InputError(
                    f"{self.network.path}: answers {answer.shape} to {len(block)} cutouts, "
                    f"expected {(len(block), len(self.names))}: one number a class"
                )
            rows.append(_probabilities(answer.astype(np.float64)))
        return np.vstack(rows)

    def meaning(self, name: str) -> Meaning:
        """Return the meaning of one class."""
        return self.meanings[self.names.index(name)]


def _probabilities(answer: Floats) -> Floats:
    """Return the softmax, or the input if the network already applies it."""
    if (answer >= 0).all() and np.allclose(answer.sum(axis=1), 1.0, atol=1e-3):
        return answer
    odds = np.exp(answer - answer.max(axis=1, keepdims=True))
    return np.asarray(odds / odds.sum(axis=1, keepdims=True))


def _names(network: Network) -> tuple[str, ...]:
    if len(set(network.names)) < len(network.names):
        raise InputError(
            f"{network.path}: metadata names: expected different classes, got {network.names}"
        )
    return network.names


def _side(network: Network) -> int:
    shape = network.input_shape
    if len(shape) != 4 or (shape[1] not in (3, "3") and isinstance(shape[1], int)):
        raise InputError(f"{network.path}: expected an input (n, 3, side, side), got {shape}")
    if isinstance(shape[2], int):
        if shape[2] != shape[3]:
            raise InputError(f"{network.path}: expected square pictures, got {shape}")
        return shape[2]
    return int(network.number("side", DEFAULT_SIDE))


def open_classifier(path: Path, classes: Mapping[str, Meaning] | None = None) -> CutoutClassifier:
    """Load a classifier from an ONNX file.

    Parameters
    ----------
    classes : meaning of its classes; overrides the file's metadata.

    Raises
    ------
    InputError : the file is missing, is not ONNX, or has no class names; or `classes` has others.
    """
    network = open_network(path)
    names = _names(network)
    classes_text = network.metadata.get("classes")
    own = {} if classes_text is None else meanings_from_json(classes_text, path)
    missing = sorted(set(classes or {}) - set(names))
    if missing:
        raise InputError(
            f"{path}: knows no class {', '.join(missing)}", f"Its classes: {', '.join(names)}."
        )
    meanings = tuple(meanings_of(names, {**own, **(classes or {})}))
    certain = network.number("certain", 0.0)
    return CutoutClassifier(network, names, meanings, _side(network), certain)


def judge_cutouts(confidences: Floats, weights: Floats, names: Sequence[str]) -> Verdict:
    """Return one verdict over the cutouts of a hold.

    The class is the one with the largest weighted sum of confidences over the cutouts.

    Parameters
    ----------
    confidences : (n, classes), n >= 1; weights : (n,) >= 0, of the cutouts.
    """
    if weights.sum() <= 0:
        weights = np.ones(len(confidences))
    sums = weights @ confidences / weights.sum()
    best = int(sums.argmax())
    rival = float(np.partition(sums, -2)[-2]) if len(sums) > 1 else 0.0
    agree = float(weights[confidences.argmax(axis=1) == best].sum() / weights.sum())
    return Verdict(names[best], (float(sums[best]) - rival) * agree)
