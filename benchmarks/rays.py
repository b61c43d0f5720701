"""Visible triangle per pixel, by z-buffer and by Embree rays: CPU seconds as a ratio.

    python -m benchmarks.rays DATA      # DATA: the folder with gym-a/lift

Ten views of 1280 x 960 on 1.33 million triangles; the time excludes building Embree's hierarchy.
Both methods alternate in one run, so the ratio holds on a busy machine too.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.lift_accuracy import load_gym
from walltopo.core import View
from walltopo.geometry.rays import Bvh
from walltopo.geometry.zbuffer import render_ids

VIEWS = 10


def pixel_rays(view: View) -> NDArray[np.float64]:
    """Return (H * W, 3) directions through each pixel's centre of a pinhole view, world frame."""
    camera = view.camera
    y, x = np.mgrid[: camera.height, : camera.width] + 0.5
    local = np.stack([(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, np.ones_like(x)], 2)
    return np.asarray(local.reshape(-1, 3) @ view.cam_from_world[:, :3])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, metavar="DATA")
    mesh, views, _ = load_gym(parser.parse_args().data, "noisy")
    embree, views = Bvh(mesh.vertices, mesh.faces), views[:: len(views) // VIEWS][:VIEWS]
    render_ids(mesh.vertices, mesh.faces, views[0].camera, views[0].cam_from_world)  # compile
    drawing, casting, same = 0.0, 0.0, []
    for view in views:
        rays = pixel_rays(view)
        begin = time.process_time()
        drawn = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)[0].ravel()
        middle = time.process_time()
        cast, _ = embree.first_hit(np.broadcast_to(view.centre, rays.shape), rays)
        drawing, casting = drawing + middle - begin, casting + time.process_time() - middle
        same.append((drawn == cast).mean())
    print(f"Embree takes {casting / drawing:.0f} times the CPU seconds of the z-buffer")
    print(f"pixels that show the same triangle: {100 * np.mean(same):.2f} %")


if __name__ == "__main__":
    main()
