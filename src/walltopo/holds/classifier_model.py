"""A classifier of cutouts in an ONNX file, and what it says of a hold over all its cutouts.

Any network that takes (n, 3, s, s) float32 RGB in [0, 1], answers (n, classes) and carries its
class names in the metadata: those of `walltopo train classifier`, and Ultralytics' exports.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.holds.classifier_meaning import Meaning, meanings_from_json, meanings_of
from walltopo.inference.session import Network, open_network

__all__ = ["CutoutClassifier", "Verdict", "judge", "open_classifier"]

Floats = NDArray[np.float64]
DEFAULT_SIDE = 224  # where the network's input is free and its metadata do not tell
BATCH = 64


@dataclass(frozen=True)
class Verdict:
    """What a classifier says of one hold.

    Parameters
    ----------
    name : the class.
    confidence : margin to the next class times the share of the cutouts that agree, by weight.
    """

    name: str
    confidence: float


@dataclass(frozen=True, eq=False)
class CutoutClassifier:
    """A loaded network.

    Parameters
    ----------
    network : as loaded.
    names : its classes; meanings : what each says of a hold, same order.
    side : of the pictures it takes, pixels.
    certain : confidence below which it should not be believed; 0 where the file does not tell.
    """

    network: Network
    names: tuple[str, ...]
    meanings: tuple[Meaning, ...]
    side: int
    certain: float = 0.0

    def confidences(self, pictures: NDArray[np.uint8]) -> Floats:
        """(n, classes) in [0, 1], rows sum to 1, of (n, side, side, 3) uint8 RGB pictures."""
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
        """Of one class."""
        return self.meanings[self.names.index(name)]


def _probabilities(answer: Floats) -> Floats:
    """Softmax, unless the network has done it."""
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
    """Load a classifier.

    Parameters
    ----------
    classes : meaning of its classes; wins over what the file's metadata say.

    Raises
    ------
    InputError : no such file, no ONNX file, no class names in it, or classes it does not have.
    """
    network = open_network(path)
    names = _names(network)
    told = network.metadata.get("classes")
    own = {} if told is None else meanings_from_json(told, path)
    missing = sorted(set(classes or {}) - set(names))
    if missing:
        raise InputError(
            f"{path}: knows no class {', '.join(missing)}", f"Its classes: {', '.join(names)}."
        )
    meanings = tuple(meanings_of(names, {**own, **(classes or {})}))
    certain = network.number("certain", 0.0)
    return CutoutClassifier(network, names, meanings, _side(network), certain)


def judge(confidences: Floats, weights: Floats, names: Sequence[str]) -> Verdict:
    """One verdict over the cutouts of a hold.

    The class confidences are summed over the cutouts, by weight; the largest sum wins.

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
