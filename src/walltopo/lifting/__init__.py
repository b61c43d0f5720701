"""2D masks to 3D instances, on any mesh with posed cameras.

>>> from walltopo.lifting import LiftParams, lift
>>> instances = lift(mesh, views, LiftParams())  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from walltopo.lifting.contract import LiftParams

if TYPE_CHECKING:
    from walltopo.core import Instances, Mesh, Progress, View

__all__ = ["LiftParams", "lift"]


def lift(
    mesh: Mesh,
    views: Sequence[View],
    params: LiftParams | None = None,
    progress: Progress | None = None,
) -> Instances:
    """Find the objects that the masks of the views show on the mesh.

    Parameters
    ----------
    mesh : triangles, world frame.
    views : posed photos with their masks; masks need no correspondence between photos.
    params : see `LiftParams`; the defaults where None.
    progress : told of the steps.

    Returns
    -------
    Instances : a label for every face of `mesh`, in its order, and a record per instance.

    Raises
    ------
    InputError : the mesh has no triangles; or lengths are normalised and no mask meets the mesh.
    """
    from walltopo.lifting.methods import run_method

    return run_method(mesh, views, params or LiftParams(), progress)
