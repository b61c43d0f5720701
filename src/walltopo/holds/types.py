"""The type of a hold from its relief: jug, crimp, sloper, pinch, pocket, foothold.

A small network that saw generated holds as scans show them (`walltopo train
hold-types`). A type is named only if the network is sure enough and the hold is of a size that it
knows; otherwise the answer is "unknown".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.holds.relief import SIDE, Relief
from walltopo.inference.session import Network, open_network
from walltopo.scans.attributes import UNKNOWN

__all__ = ["NONE_OF_THESE", "TypeModel", "open_model", "shipped_model"]

NONE_OF_THESE = "none of these"  # the network's class of what is no hold of any one type
BATCH = 128
# A hold is seen several times, turned by degrees and scaled: which triangles are at its rim, and
# how the wall under it leans, should not decide.
LOOKS = ((0.0, 1.0), (-10.0, 1.0), (10.0, 1.0), (0.0, 0.93), (0.0, 1.07))


def _seen_anew(reliefs: Sequence[Relief], degrees: float, scale: float) -> NDArray[np.float32]:
    """(n, 2, SIDE, SIDE) pictures of reliefs, turned and scaled about their middle."""
    middle = (SIDE - 1) / 2
    matrix = cv2.getRotationMatrix2D((middle, middle), degrees, scale)
    turned = [
        [cv2.warpAffine(layer, matrix, (SIDE, SIDE)) for layer in relief.picture]
        for relief in reliefs
    ]
    return np.asarray(turned, dtype=np.float32)


@dataclass(frozen=True, eq=False)
class TypeModel:
    """A loaded network.

    Parameters
    ----------
    network : as loaded.
    names : its classes, `NONE_OF_THESE` among them.
    certain : probability from which a type is named.
    sides : least and largest side of a relief's frame that it knows, metres.
    """

    network: Network
    names: tuple[str, ...]
    certain: float
    sides: tuple[float, float]

    def probabilities(self, reliefs: Sequence[Relief]) -> NDArray[np.float32]:
        """(n, classes) float32 in [0, 1], rows sum to 1: the mean over `LOOKS`."""
        rows = [np.zeros((0, len(self.names)), dtype=np.float32)]
        for first in range(0, len(reliefs), BATCH):
            block = reliefs[first : first + BATCH]
            scalars = np.stack([relief.scalars for relief in block])
            answers = [
                self.network.session.run(None, {"reliefs": pictures, "scalars": scalars})[0]
                for pictures in (_seen_anew(block, *look) for look in LOOKS)
            ]
            rows.append(np.mean(answers, axis=0))
        return np.vstack(rows)

    def names_of(self, reliefs: Sequence[Relief]) -> list[tuple[str, float]]:
        """The type of each hold, or "unknown", and its probability."""
        found = []
        for relief, row in zip(reliefs, self.probabilities(reliefs), strict=True):
            best = int(row.argmax())
            sure, name = float(row[best]), self.names[best]
            known = self.sides[0] <= relief.side_m <= self.sides[1]
            if name == NONE_OF_THESE or sure < self.certain or not known:
                name = UNKNOWN
            found.append((name, sure))
        return found


@cache
def shipped_model() -> TypeModel:
    """The network in `models/hold_types.onnx`."""
    return open_model(Path(__file__).parents[1] / "models" / "hold_types.onnx")


def open_model(path: Path) -> TypeModel:
    """A network as `walltopo train hold-types` writes it.

    Raises
    ------
    InputError : no such file, or another kind of network.
    """
    network = open_network(path, threads=1)  # so small that threads cost more than they bring
    missing = sorted({"names", "certain", "sides"} - set(network.metadata))
    if missing:
        raise InputError(f"{path}: no network of hold types: its metadata lack {missing}")
    low, high = network.numbers("sides", [0.0, np.inf])
    return TypeModel(network, network.names, network.number("certain", 1.0), (low, high))
