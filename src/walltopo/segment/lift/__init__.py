"""Lift 2D masks to 3D instances, on any mesh with posed cameras."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from walltopo.segment.lift.settings import LiftParams

if TYPE_CHECKING:
    from walltopo.core import Instances, Mesh, Progress, View

__all__ = ["LiftParams", "lift"]


def lift(
    mesh: Mesh,
    views: Sequence[View],
    params: LiftParams | None = None,
    progress: Progress | None = None,
) -> Instances:
    """Return the objects that the masks of the views show on the mesh.

    Parameters
    ----------
    mesh : triangles in the world frame.
    views : posed photos with their masks. Masks need no correspondence between photos.
    params : see `LiftParams`; None means the defaults.
    progress : receives the steps.

    Returns
    -------
    Instances : a label for every face of `mesh`, in its order, and a record per instance.

    Raises
    ------
    InputError : the mesh has no triangles; or lengths are normalised and no mask hits the mesh.

    Examples
    --------
    A plate of 1 x 1 m with 64 squares of two triangles each. Three cameras 2 m in front of it
    each have a mask of the same square, a quarter metre wide:

    >>> import numpy as np
    >>> from walltopo.core import Camera, Mask, Mesh, View
    >>> x, y = np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.5, 0.5, 9))
    >>> corners = np.column_stack([x.ravel(), y.ravel(), np.full(81, 2.0)])
    >>> first = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    >>> squares = [np.column_stack([first, first + 9, first + 1]),
    ...            np.column_stack([first + 1, first + 9, first + 10])]
    >>> mesh = Mesh(corners, np.vstack(squares).astype(np.int32))
    >>> camera = Camera("PINHOLE", 400, 400, (400.0, 400.0, 200.0, 200.0))
    >>> views = []
    >>> for step in (-0.1, 0.0, 0.1):
    ...     pose = np.eye(4)[:3]
    ...     pose[0, 3] = step
    ...     picture = np.zeros((400, 400), dtype=np.bool_)
    ...     left = int(200 + 200 * step)
    ...     picture[200:250, left : left + 50] = True
    ...     views.append(View(f"{step}.jpg", camera, pose, (Mask.from_full(picture, label=1),)))
    >>> found = lift(mesh, views)
    >>> len(found), float(mesh.areas[found.faces_of(1)].sum())
    (1, 0.0625)
    """
    from walltopo.segment.lift.methods import run_method

    return run_method(mesh, views, params or LiftParams(), progress)
