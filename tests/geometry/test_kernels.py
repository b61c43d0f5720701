"""Kernels onto all cores: every index once, whatever the number of cores."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import walltopo
from walltopo.geometry import kernels
from walltopo.geometry.kernels import in_ranges


@given(count=st.integers(0, 200), least=st.integers(0, 50), threads=st.integers(1, 16))
def test_every_index_is_worked_on_once(count: int, least: int, threads: int) -> None:
    met = np.zeros(count, dtype=np.int64)

    def work(begin: int, end: int, step: int) -> None:
        met[begin:end] += step

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels, "available_cores", lambda: threads)
        in_ranges(work, count, 3, min_size=least)
    assert (met == 3).all()


def test_what_a_range_raises_is_raised() -> None:
    def work(begin: int, end: int) -> None:
        raise MemoryError(f"{begin} to {end}")

    with pytest.raises(MemoryError):
        in_ranges(work, 100)


def test_all_kernels_are_compiled_the_cheap_way() -> None:
    """The one decorator decides how: `parallel=True` costs the first scan seconds a kernel."""
    product = Path(walltopo.__file__).parent
    for file in product.rglob("*.py"):
        imported = {
            name.name
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
            if isinstance(node, ast.ImportFrom) and node.module == "numba"
            for name in node.names
        }
        assert not imported & {"jit", "njit", "prange", "vectorize"} or file.name == "kernels.py", (
            file
        )
