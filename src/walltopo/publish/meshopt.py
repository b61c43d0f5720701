"""Edge-collapse simplification by meshoptimizer's C library.

The Python wrapper declares no argument types for `meshopt_simplifyWithAttributes`, so its calls
pass floats and sizes wrongly. This module declares them.
Source: A. Kapoulkine, meshoptimizer, `meshoptimizer.h`.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray


@cache
def available() -> bool:
    """Return whether meshoptimizer is installed: its build from source needs a compiler."""
    from importlib.util import find_spec

    return find_spec("meshoptimizer") is not None


@cache
def _function() -> Any:
    from meshoptimizer._loader import lib

    function = lib.meshopt_simplifyWithAttributes
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    function.argtypes = [
        *(pointer, pointer, size),  # destination, indices, index count
        *(pointer, size, size),  # positions, vertex count, stride
        *(pointer, size, pointer, size),  # attributes, stride, weights, attribute count
        pointer,  # vertex lock
        *(size, ctypes.c_float, ctypes.c_uint),  # target index count, target error, options
        ctypes.POINTER(ctypes.c_float),  # resulting error
    ]
    function.restype = size
    return function


def simplify_indices(
    triangles: NDArray[np.uint32],
    positions: NDArray[np.float32],
    attributes: NDArray[np.float32],
    weights: NDArray[np.float32],
    target: int,
) -> NDArray[np.uint32]:
    """Return triangles after collapsing edges to about `target`; vertices do not move.

    Parameters
    ----------
    triangles : (T, 3) uint32.
    positions : (V, 3) float32. Vertices at one position form a seam whose sides move together.
    attributes : (V, n) float32, preserved in addition to the shape.
    weights : (n,) float32, weight of an attribute error of 1 against an error of the mesh's size.

    Returns
    -------
    (K, 3) uint32, K about `target`, or more if seams leave nothing to collapse.
    """
    indices = np.ascontiguousarray(triangles, dtype=np.uint32).ravel()
    places = np.ascontiguousarray(positions, dtype=np.float32)
    values = np.ascontiguousarray(attributes, dtype=np.float32)
    scale = np.ascontiguousarray(weights, dtype=np.float32)
    result = np.zeros_like(indices)
    error = ctypes.c_float(0.0)
    kept = _function()(
        result.ctypes.data,
        indices.ctypes.data,
        len(indices),
        places.ctypes.data,
        len(places),
        places.strides[0],
        values.ctypes.data,
        values.strides[0],
        scale.ctypes.data,
        len(scale),
        None,
        target * 3,
        1.0,  # no limit on the error: the number of triangles decides
        0,
        ctypes.byref(error),
    )
    return result[:kept].reshape(-1, 3)
