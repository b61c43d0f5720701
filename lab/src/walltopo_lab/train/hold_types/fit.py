"""Train the network that predicts hold types from relief: `walltopo train hold-types`.

It makes synthetic holds of two kinds, the generator's bodies and forms of a shape grammar, and adds
scan artefacts. It trains an ensemble of three networks. The threshold probability of a named type
is the lowest at which nine of ten named types are correct. It is chosen on other synthetic holds,
or on scans of gyms with known truth, which are harder.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.describe.classify.types import NONE_OF_THESE, Relief, open_model
from walltopo.scans.holds import UNKNOWN
from walltopo_lab.evaluate.types import name_types_on_scans
from walltopo_lab.onnx_file import set_metadata
from walltopo_lab.synth.holds import STYLES, make_hold
from walltopo_lab.train.hold_types.net import Samples, train, write_onnx
from walltopo_lab.train.hold_types.scanned import (
    frontal_heights,
    grammar_heights,
    nothing_known,
    scanned_relief,
)

TYPES = ("jug", "crimp", "sloper", "pinch", "pocket", "foothold")
# Standard deviation of the setter's rotation, degrees, as in `walltopo_lab.synth.setter`.
TURN_DEG = {"jug": 18, "crimp": 28, "sloper": 25, "pinch": 40, "pocket": 20, "foothold": 60}
SCALES = (0.85, 1.0, 1.15, 1.5)  # scales of a route's holds, as in the setter
DETAIL = 0.8
VIEWS = 3  # scans of each body
NETS, EPOCHS = 3, 16
RIGHT = 0.9


def _simulated_scans(kind: str, count: int, rng: np.random.Generator) -> list[Relief | None]:
    """Return simulated scans of the generator's holds."""
    found = []
    for _ in range(count):
        scale, style = float(rng.choice(SCALES)), str(rng.choice(STYLES))
        body = make_hold("foot" if kind == "foothold" else kind, style, rng, scale, DETAIL)
        found += [
            scanned_relief(*frontal_heights(body, rng, TURN_DEG[kind]), rng) for _ in range(VIEWS)
        ]
    return found


def make_reliefs(
    bodies: int, forms: int, others: int, seed: int
) -> tuple[list[Relief], NDArray[np.int64]]:
    """Return reliefs of synthetic holds and their labels, `len(TYPES)` for no known type.

    Parameters
    ----------
    bodies, forms : number of holds of each type from the generator (each scanned `VIEWS` times) and
        from the grammar.
    others : number of objects that belong to no single type.
    """
    cv2.setNumThreads(1)  # for images this small, starting threads takes longer than the work
    rng = np.random.default_rng(seed)
    rows: list[tuple[Relief | None, int]] = []
    for label, kind in enumerate(TYPES):
        rows += [(relief, label) for relief in _simulated_scans(kind, bodies, rng)]
        rows += [(scanned_relief(*grammar_heights(kind, rng), rng), label) for _ in range(forms)]
    rows += [(scanned_relief(*nothing_known(rng), rng), len(TYPES)) for _ in range(others)]
    kept = [(relief, label) for relief, label in rows if relief is not None]
    return [relief for relief, _ in kept], np.array([label for _, label in kept])


def min_certain(sure: NDArray[np.floating[Any]], right: NDArray[np.bool_]) -> float:
    """Return the lowest probability threshold at which `RIGHT` of the named types are correct.

    Parameters
    ----------
    sure : (n,) probability of each predicted type, 0 without a prediction.
    right : (n,) whether the predicted type is correct.
    """
    for certain in np.arange(0.3, 1.0, 0.05):
        named = sure >= certain
        if named.any() and right[named].mean() >= RIGHT:
            break
    return round(float(certain), 2)


def _sure_of_made_up(
    path: Path, size: float
) -> tuple[NDArray[np.floating[Any]], NDArray[np.bool_]]:
    """Return the inputs of `min_certain` on synthetic holds outside the training set."""
    others, truth = make_reliefs(round(60 * size), round(180 * size), round(100 * size), 2)
    answers = open_model(path).probabilities(others)
    best = answers.argmax(axis=1)
    return np.where(best < len(TYPES), answers.max(axis=1), 0), best == truth


def _sure_on_scans(
    path: Path, scans: Sequence[tuple[Path, Path]]
) -> tuple[NDArray[np.floating[Any]], NDArray[np.bool_]]:
    """Return the inputs of `min_certain` on lifted instances."""
    _, lifted = name_types_on_scans(open_model(path), scans, 0.0)
    answers = lifted.answers.items()
    sure = np.array([sure if name != UNKNOWN else 0.0 for _, (name, sure) in answers])
    return sure, np.array([name == lifted.truth[key] for key, (name, _) in answers])


def fit_hold_types(
    path: Path, scans: Sequence[tuple[Path, Path]], progress: Progress, size: float = 1.0
) -> float:
    """Make synthetic holds, train, choose the probability threshold, and write the file.

    Parameters
    ----------
    path : ONNX file to write.
    scans : gyms with truth and their scans for choosing the threshold; none: synthetic holds.
    size : share of the holds and epochs of a full training.

    Returns
    -------
    The threshold.
    """
    progress.step("making holds")
    found, label = make_reliefs(round(500 * size), round(1300 * size), round(2200 * size), 1)
    samples = Samples(
        np.stack([relief.picture for relief in found]),
        np.stack([relief.scalars for relief in found]),
        label,
    )
    progress.note(f"{len(found)} reliefs")
    progress.step("training")
    epochs = max(1, round(size * EPOCHS))
    nets = [train(samples, len(TYPES) + 1, epochs, seed, progress) for seed in range(NETS)]
    sides = [relief.side_m for relief, k in zip(found, label, strict=True) if k < len(TYPES)]
    facts: dict[str, Any] = {
        "names": [*TYPES, NONE_OF_THESE],
        "sides": np.percentile(sides, [0.1, 99.9]).round(3).tolist(),
        "certain": 0.0,
    }
    write_onnx(nets, path, facts)
    progress.step("choosing how sure it must be")
    sure, right = _sure_on_scans(path, scans) if scans else _sure_of_made_up(path, size)
    certain = min_certain(sure, right)
    set_metadata(path, {"certain": json.dumps(certain)})
    named = sure >= certain
    progress.note(f"{named.sum()} of {len(named)} named, {(right & named).sum()} rightly")
    return certain
