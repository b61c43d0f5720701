"""The variables that limit the threads of libraries do so in a child process."""

from __future__ import annotations

import sys

from walltopo.core.children import child_process
from walltopo.core.parallel import library_threads

_COUNT = "import cv2, numba; print(cv2.getNumThreads(), numba.config.NUMBA_NUM_THREADS)"


def test_a_child_starts_no_more_threads_than_the_limit() -> None:
    command = [sys.executable, "-c", _COUNT]
    with child_process(command, environment=library_threads(1)) as child:
        assert child.output.read().split() == [b"1", b"1"]


def test_blas_may_have_a_limit_of_its_own() -> None:
    assert library_threads(0) == library_threads(-1) == {}
    assert library_threads(-1, blas=1) == {"OPENBLAS_NUM_THREADS": "1"}
    assert library_threads(3)["OPENBLAS_NUM_THREADS"] == "3"
    assert library_threads(3, blas=1)["OPENBLAS_NUM_THREADS"] == "1"
