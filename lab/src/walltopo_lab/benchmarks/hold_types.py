"""Train and check the network that names hold types by their relief.

    python -m walltopo_lab.benchmarks.hold_types fit             trains on made-up holds, writes the network
    python -m walltopo_lab.benchmarks.hold_types report [DATA]   accuracy on the rendered gym (another generator)

`fit` makes holds of two kinds, the generator's bodies and those of a grammar of forms, gives them
the faults of a scan, and trains three networks that answer together. The probability from which a
type is named is chosen on other such holds: the lowest that makes nine of ten named types right.
Scans are harder than that; `python -m walltopo_lab.benchmarks.types choose` raises it on some.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.holds.geometry import measure_shapes
from walltopo.holds.relief import Relief, reliefs
from walltopo.holds.types import NONE_OF_THESE, open_model, shipped_model
from walltopo.scans.attributes import UNKNOWN
from walltopo_lab.benchmarks.hold_types_scanned import drawn, formed, nothing_known, scanned
from walltopo_lab.evaluate.routes import type_of_kind
from walltopo_lab.onnx_file import set_metadata
from walltopo_lab.synth.holds import STYLES, make_hold

MODEL = Path(__file__).parents[1] / "src" / "walltopo" / "models" / "hold_types.onnx"
TYPES = ("jug", "crimp", "sloper", "pinch", "pocket", "foothold")
# How far setters turn each, degrees; as `walltopo_lab.synth.setter` does.
TURN_DEG = {"jug": 18, "crimp": 28, "sloper": 25, "pinch": 40, "pocket": 20, "foothold": 60}
SCALES = (0.85, 1.0, 1.15, 1.5)  # of a route's holds, as there
DETAIL = 0.8
VIEWS = 3  # scans of each body
NETS, EPOCHS = 3, 16
RIGHT = 0.9


def _bodies(kind: str, count: int, rng: np.random.Generator) -> list[Relief | None]:
    """Scans of the generator's holds."""
    found = []
    for _ in range(count):
        scale, style = float(rng.choice(SCALES)), str(rng.choice(STYLES))
        body = make_hold("foot" if kind == "foothold" else kind, style, rng, scale, DETAIL)
        found += [scanned(*drawn(body, rng, TURN_DEG[kind]), rng) for _ in range(VIEWS)]
    return found


def make(bodies: int, forms: int, others: int, seed: int) -> tuple[list[Relief], NDArray[np.int64]]:
    """Reliefs of made-up holds and their labels, `len(TYPES)` for none of these.

    Parameters
    ----------
    bodies, forms : holds of each type by the generator (each scanned `VIEWS` times), by grammar.
    others : things that are no hold of any one type.
    """
    cv2.setNumThreads(1)  # pictures so small are done sooner than threads are started
    numba.set_num_threads(1)
    rng = np.random.default_rng(seed)
    rows: list[tuple[Relief | None, int]] = []
    for label, kind in enumerate(TYPES):
        rows += [(relief, label) for relief in _bodies(kind, bodies, rng)]
        rows += [(scanned(*formed(kind, rng), rng), label) for _ in range(forms)]
    rows += [(scanned(*nothing_known(rng), rng), len(TYPES)) for _ in range(others)]
    kept = [(relief, label) for relief, label in rows if relief is not None]
    return [relief for relief, _ in kept], np.array([label for _, label in kept])


def least_certain(sure: NDArray[np.floating[Any]], right: NDArray[np.bool_]) -> float:
    """The least probability from which `RIGHT` of the named are named rightly; printed.

    Parameters
    ----------
    sure : (n,) probability of each type that would be named, 0 where none would.
    right : (n,) whether it is the right one.
    """
    for certain in np.arange(0.3, 1.0, 0.05):
        named = sure >= certain
        share = float(right[named].mean())
        print(f"certain {certain:.2f}: {named.mean():.2f} named, {share:.3f} right")
        if share >= RIGHT:
            break
    return round(float(certain), 2)


def fit() -> None:
    """Make holds, train, choose the threshold on other holds, write the file."""
    from walltopo_lab.benchmarks.hold_types_net import Samples, train, write_onnx

    start = time.process_time()
    found, label = make(500, 1300, 2200, 1)
    print(f"{len(found)} reliefs in {time.process_time() - start:.0f} CPU-seconds", flush=True)
    samples = Samples(
        np.stack([relief.picture for relief in found]),
        np.stack([relief.scalars for relief in found]),
        label,
    )
    nets = [train(samples, len(TYPES) + 1, EPOCHS, seed) for seed in range(NETS)]
    sides = [relief.side_m for relief, k in zip(found, label, strict=True) if k < len(TYPES)]
    facts: dict[str, Any] = {
        "names": [*TYPES, NONE_OF_THESE],
        "sides": np.percentile(sides, [0.1, 99.9]).round(3).tolist(),
        "certain": 0.0,
    }
    write_onnx(nets, MODEL, facts)
    others, truth = make(60, 180, 100, 2)
    answers = open_model(MODEL).probabilities(others)
    best = answers.argmax(axis=1)
    sure = np.where(best < len(TYPES), answers.max(axis=1), 0)
    set_metadata(MODEL, {"certain": json.dumps(least_certain(sure, best == truth))})
    print(f"{MODEL.stat().st_size / 1e3:.0f} kB, {time.process_time() - start:.0f} CPU-seconds")


def report(data: Path) -> None:
    """Print accuracy on gym-a's true instances."""
    source = np.load(data / "gym-a" / "lift" / "gt.npz")
    scene = json.loads((data / "gym-a" / "scene.json").read_text(encoding="utf-8"))
    kinds = {e["id"]: type_of_kind(e["kind"]) for e in scene["instances"] if e["class"] == "hold"}
    mesh = Mesh(source["vertices"], source["faces"])
    labels = source["face_instance"].astype(np.int32)
    found = types_of(mesh, labels, sorted(kinds))
    known = [k for k in found if found[k] != UNKNOWN]
    right = sum(found[k] == kinds[k] for k in known)
    print(f"{len(found)} holds: {len(known)} named, {right} of them right")
    for pair, count in sorted(Counter((kinds[k], found[k]) for k in found).items()):
        print(f"  {pair[0]} called {pair[1]}: {count}")


def answers_of(
    mesh: Mesh, labels: NDArray[np.int32], ids: list[int], certain: float | None = None
) -> dict[int, tuple[str, float]]:
    """What the shipped network says of the instances that have triangles, and how sure it is.

    Parameters
    ----------
    mesh : in metres; certain : another least probability than the network's own.
    """
    shapes = measure_shapes(mesh, labels, ids)
    looks = reliefs(mesh, labels, shapes, 1.0)
    model = shipped_model()
    model = model if certain is None else replace(model, certain=certain)
    named = dict(zip(looks, model.names_of(list(looks.values())), strict=True))
    return {number: named.get(number, (UNKNOWN, 0.0)) for number in shapes}


def types_of(mesh: Mesh, labels: NDArray[np.int32], ids: list[int]) -> dict[int, str]:
    """What the shipped network says of the instances that have triangles; metres."""
    return {number: name for number, (name, _) in answers_of(mesh, labels, ids).items()}


def main() -> None:
    if len(sys.argv) < 2 or sys.argv[1] not in ("fit", "report"):
        raise SystemExit(__doc__)
    if sys.argv[1] == "fit":
        fit()
    else:
        report(Path(sys.argv[2] if len(sys.argv) > 2 else "../shared/data"))


if __name__ == "__main__":
    main()
