"""Simplify a large mesh in a subprocess: `python -m walltopo.describe.routes.simplify_worker`.

The library keeps the memory of its largest mesh (0.75 GB for a wall) until its process ends. A
subprocess ends soon.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError
from walltopo.core.children import child_process, describe_exit, python_module

Points = NDArray[np.float32]
Triangles = NDArray[np.int32]


def simplified(points: Points, triangles: Triangles, target: int) -> tuple[Points, Triangles]:
    """Return (V, 3) points and (F, 3) triangles, simplified to about `target` triangles."""
    import fast_simplification

    points, triangles = fast_simplification.simplify(points, triangles, target_count=target, agg=5)
    return points, triangles


def simplified_in_subprocess(
    points: Points, triangles: Triangles, target: int
) -> tuple[Points, Triangles]:
    """Return the result of `simplified`, computed in a subprocess.

    Raises
    ------
    StageError : the subprocess failed.
    """
    with tempfile.TemporaryDirectory(prefix="walltopo-simplify-") as name:
        folder = Path(name)
        np.save(folder / "points.npy", points)
        np.save(folder / "triangles.npy", triangles)
        command = python_module(__name__, name, str(target))
        with child_process(command, errors=subprocess.STDOUT) as child:
            printed = child.output.read().decode("utf-8", "replace")
            code = child.wait()
        if code:
            raise StageError(
                f"the mesh of {len(triangles)} triangles could not be simplified (the process "
                f"ended with {describe_exit(code)}): {printed.strip()[-500:]}"
            )
        return np.load(folder / "points.npy"), np.load(folder / "triangles.npy")


def main() -> None:
    """Simplify the mesh in the folder of the first argument in place."""
    folder, target = Path(sys.argv[1]), int(sys.argv[2])
    points, triangles = np.load(folder / "points.npy"), np.load(folder / "triangles.npy")
    points, triangles = simplified(points, triangles, target)
    np.save(folder / "points.npy", points)
    np.save(folder / "triangles.npy", triangles)


if __name__ == "__main__":
    main()
