"""Which holds are worth a setter's look: colours on generated gyms, right or wrong, by confidence.

    python -m walltopo_lab.benchmarks.colour_review GYM [GYM ...]

Each GYM is a folder of `walltopo synth`; its true instances are coloured from its photos as in
a scan. A palette entry means the true colour of most of its holds. Printed for several values of
`classify.review_below`: how many holds would be listed, how many of those are wrong (precision),
and which share of the wrong ones is listed (recall).
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np

from walltopo.core import Mesh, Silent
from walltopo.holds.colour import assign_colours, find_palette, paint_over_views
from walltopo.holds.contract import ClassifySettings
from walltopo.holds.geometry import measure_shapes
from walltopo.holds.observe import gather
from walltopo.scans.model import read_views

LEVELS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)


def coloured(gym: Path, settings: ClassifySettings) -> list[tuple[float, bool]]:
    """Confidence of each hold, and whether its colour is right."""
    with np.load(gym / "truth" / "gt.npz") as data:
        mesh = Mesh(data["vertices"], data["faces"].astype(np.int32))
        labels = data["face_instance"].astype(np.int32)
    scene = json.loads((gym / "truth" / "scene.json").read_text(encoding="utf-8"))
    kinds = {int(item["id"]): str(item["class"]) for item in scene["instances"]}
    truth = {int(item["id"]): str(item["colour"]) for item in scene["instances"]}
    views = read_views(gym / "truth" / "cameras")
    seen, light = gather(views, gym / "photos", mesh, labels, settings, Silent())
    shapes = measure_shapes(mesh, labels, sorted(kinds))
    positions = {number: shape.position for number, shape in shapes.items()}
    seen = {number: rows for number, rows in sorted(seen.items()) if number in positions}
    volumes = {number for number, kind in kinds.items() if kind == "volume"}
    paints = paint_over_views(seen, light, positions)
    spread, weight = settings.colour_spread, settings.lightness_weight
    palette = find_palette(paints, volumes, spread=spread, lightness_weight=weight)
    found = assign_colours(paints, palette, spread=spread, lightness_weight=weight)
    holds = [number for number in found if number not in volumes]
    meant = {}
    for name in {found[number].name for number in holds}:
        members = [truth[number] for number in holds if found[number].name == name]
        meant[name] = Counter(members).most_common(1)[0][0]
    return [(found[n].confidence, meant[found[n].name] == truth[n]) for n in holds]


def main() -> None:
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    rows: list[tuple[float, bool]] = []
    for word in sys.argv[1:]:
        own = coloured(Path(word), ClassifySettings())
        rows += own
        print(
            f"{Path(word).name}: {sum(right for _, right in own)} of {len(own)} right", flush=True
        )
    confidence = np.array([value for value, _ in rows])
    wrong = np.array([not right for _, right in rows])
    print(f"{len(rows)} holds, {wrong.sum()} of them in a wrong colour")
    for level in LEVELS:
        listed = confidence < level
        hits = int((listed & wrong).sum())
        print(
            f"review_below {level}: {listed.sum()} listed ({listed.mean():.1%}), precision "
            f"{hits / max(int(listed.sum()), 1):.2f}, recall {hits / max(int(wrong.sum()), 1):.2f}"
        )


if __name__ == "__main__":
    main()
