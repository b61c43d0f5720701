"""Route clustering by colour names or by paint, in 3D: generated gyms with their photos.

    python -m benchmarks.routes_links GYM [GYM ...]

Each GYM is a folder of `walltopo synth`, or of the rendered gym (DATA/gym-a). Instances and
downclimb holds are the true ones; colours are read from the photos as in a scan. ARI covers the
holds that belong to a route.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from msgspec.structs import replace as changed

from benchmarks.colours import generated_scan, scale, true_scan
from benchmarks.routes import rand_index
from walltopo.core import Mesh, Silent
from walltopo.describe.classify.colour import (
    assign_colours,
    find_palette,
    paint_over_views,
    with_white,
)
from walltopo.describe.classify.geometry import measure_shapes
from walltopo.describe.classify.light import TINT_RADIUS, observe
from walltopo.describe.routes.find import find_routes
from walltopo.describe.settings import ClassifySettings, RoutesSettings
from walltopo.scans.holds import Hold
from walltopo.scans.photos import PhotoSet
from walltopo_lab.evaluate.truth import read_truth


def holds_of(folder: Path) -> tuple[Mesh, list[Hold], dict[int, int]]:
    """Return mesh, holds with the colours read from the photos, and the true routes."""
    settings = ClassifySettings()
    made = (folder / "truth" / "cameras").is_dir()
    views, mesh, labels, _, kinds = generated_scan(folder) if made else true_scan(folder, False)
    truth = read_truth(folder).instances
    seen, light = observe(views, PhotoSet(folder / "photos"), mesh, labels, settings, Silent())
    shapes = measure_shapes(mesh, labels, sorted(kinds))
    seen = {k: rows for k, rows in sorted(seen.items()) if k in shapes}
    places = {k: shape.position for k, shape in shapes.items()}
    light = with_white(light, seen)
    paints = paint_over_views(seen, light)
    volumes = {k for k, kind in kinds.items() if kind == "volume"}
    palette = find_palette(paints, volumes, **scale(settings))
    colours = assign_colours(paints, palette, **scale(settings))
    chosen = [k for k in colours if k not in volumes and truth[k].route >= 0]
    tints = light.tint_at(np.array([places[k] for k in chosen]), TINT_RADIUS)
    holds = []
    for k, tint in zip(chosen, tints.tolist(), strict=True):
        x, y, z = (float(v) for v in places[k])
        hold = Hold(k, "hold", position=(x, y, z), colour=colours[k].name)
        holds.append(changed(hold, colour_rgb=colours[k].rgb, wall_tint=tuple(tint)))
    return mesh, holds, {k: truth[k].route for k in chosen}


def main() -> None:
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    settings = RoutesSettings()
    print("| gym | holds | by name | by paint |\n|---|---|---|---|")
    for word in sys.argv[1:]:
        mesh, holds, truth = holds_of(Path(word))
        aris = [
            rand_index(find_routes(mesh, holds, replace(settings, link=link))[0], truth)
            for link in ("colour", "paint")
        ]
        name = Path(word).name
        print(f"| {name} | {len(holds)} | {aris[0]:.3f} | {aris[1]:.3f} |", flush=True)


if __name__ == "__main__":
    main()
