"""Fit and check the model that names hold types by shape.

    python -m benchmarks.hold_types fit       fits on generated holds, writes models/hold_types.json
    python -m benchmarks.hold_types report    accuracy on the rendered gym (another generator)

`fit` chooses the probability from which a type is named on other generated holds: the lowest
that makes nine of ten named types right there.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.routes.geometry import Shape, measure_shapes
from walltopo.routes.hold_type import TypeModel, measures, shipped_model
from walltopo.synth.holds import HOLD_KINDS, STYLES, make_hold
from walltopo.workspace import write_json

MODEL = Path(__file__).parents[1] / "src" / "walltopo" / "models" / "hold_types.json"
SHRINK = 0.15  # towards the covariance of all types together
Floats = NDArray[np.float64]


def name_of_kind(kind: str) -> str:
    """The generator's word to ours."""
    return "foothold" if kind == "foot" else kind


def bolted(kind: str, rng: np.random.Generator) -> Shape:
    """The shape of one generated hold on a wall, as a scan would have it.

    What cameras see of it: triangles that face out, with 1.5 mm of noise.
    """
    style = str(rng.choice(STYLES))
    body = make_hold(kind, style, rng, float(rng.uniform(0.8, 1.25)), 0.3)
    turn = np.radians(rng.normal(0, 20))
    c, s = np.cos(turn), np.sin(turn)
    points = body.vertices @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
    corners = points[body.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    seen = (corners[..., 2].mean(axis=1) > 0.002) & (normal[:, 2] > -0.35)
    grid = np.linspace(-0.6, 0.6, 41)
    u, v = np.meshgrid(grid, grid)
    first = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()
    wall = np.column_stack([u.ravel(), v.ravel(), np.zeros(u.size)])
    wall_faces = np.vstack(
        [
            np.column_stack([first, first + 1, first + 42]),
            np.column_stack([first, first + 42, first + 41]),
        ]
    )
    vertices = np.vstack([wall, points])
    vertices = vertices + rng.normal(0, 0.0015, vertices.shape)
    # Body frame (right, up, out) to the world: x right, z up, y into the wall; leaning over.
    lean = np.radians(rng.uniform(-5, 40))
    up, out = (
        np.array([0, -np.sin(lean), np.cos(lean)]),
        np.array([0, -np.cos(lean), -np.sin(lean)]),
    )
    world = vertices @ np.stack([[1.0, 0, 0], up, out])
    faces = np.vstack([wall_faces, body.faces[seen] + len(wall)]).astype(np.int32)
    labels = np.r_[np.zeros(len(wall_faces)), np.ones(int(seen.sum()))].astype(np.int32)
    return measure_shapes(Mesh(world, faces), labels, [1])[1]


def sample(count: int, seed: int) -> tuple[Floats, list[str]]:
    """(6 count, 8) measures and names of generated holds."""
    rng = np.random.default_rng(seed)
    rows, names = [], []
    for kind in HOLD_KINDS:
        for _ in range(count):
            rows.append(measures(bolted(kind, rng), 1.0))
            names.append(name_of_kind(kind))
    return np.array(rows), names


def fit() -> None:
    """Fit, choose the threshold on other holds, write the file."""
    values, names = sample(150, 1)
    kinds = [name_of_kind(kind) for kind in HOLD_KINDS]
    groups = [values[[n == kind for n in names]] for kind in kinds]
    means = np.array([group.mean(axis=0) for group in groups])
    spread = np.diag(np.full(values.shape[1], 1e-4))
    pooled = np.mean([np.cov(group.T) for group in groups], axis=0)
    covariances = [(1 - SHRINK) * np.cov(g.T) + SHRINK * pooled + spread for g in groups]
    precisions = np.array([np.linalg.inv(c) for c in covariances])
    offsets = 0.5 * np.linalg.slogdet(precisions)[1]
    checks, truth = sample(60, 2)
    for certain in np.arange(0.5, 1.0, 0.05):
        model = TypeModel(tuple(kinds), means, precisions, offsets, float(certain), 30.0)
        named = [(model.name(row)[0], name) for row, name in zip(checks, truth, strict=True)]
        known = [(a, b) for a, b in named if a != "unknown"]
        right = np.mean([a == b for a, b in known])
        print(f"certain {certain:.2f}: {len(known) / len(named):.2f} named, {right:.3f} right")
        if right >= 0.9:
            break
    write_json(
        MODEL,
        {
            "names": kinds,
            "means": means.round(5).tolist(),
            "precisions": precisions.round(4).tolist(),
            "certain": round(float(certain), 2),
            "familiar": 30.0,
        },
    )


def report(data: Path) -> None:
    """Print accuracy on gym-a's true instances."""
    source = np.load(data / "gym-a" / "lift" / "gt.npz")
    scene = json.loads((data / "gym-a" / "scene.json").read_text(encoding="utf-8"))
    kinds = {e["id"]: name_of_kind(e["kind"]) for e in scene["instances"] if e["class"] == "hold"}
    mesh = Mesh(source["vertices"], source["faces"])
    shapes = measure_shapes(mesh, source["face_instance"].astype(np.int32), sorted(kinds))
    model = shipped_model()
    found = {k: model.name(measures(shape, 1.0))[0] for k, shape in shapes.items()}
    known = [k for k in found if found[k] != "unknown"]
    right = sum(found[k] == kinds[k] for k in known)
    print(f"{len(found)} holds: {len(known)} named, {right} of them right")
    for pair, count in sorted(Counter((kinds[k], found[k]) for k in found).items()):
        print(f"  {pair[0]} called {pair[1]}: {count}")


def main() -> None:
    if len(sys.argv) < 2 or sys.argv[1] not in ("fit", "report"):
        raise SystemExit(__doc__)
    if sys.argv[1] == "fit":
        fit()
    else:
        report(Path(sys.argv[2] if len(sys.argv) > 2 else "../shared/data"))


if __name__ == "__main__":
    main()
