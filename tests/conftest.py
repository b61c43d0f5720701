"""Fixtures that all tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def _data_root() -> Path:
    return Path(
        os.environ.get(
            "WALLTOPO_TEST_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"
        )
    )


@pytest.fixture(scope="session")
def data_root() -> Path:
    """The folder of test data beside the checkout; tests that want it skip where it is absent."""
    root = _data_root()
    if not (root / "README.md").is_file():
        pytest.skip(f"test data not found at {root} (set WALLTOPO_TEST_DATA)")
    return root


@pytest.fixture(scope="session")
def gym_a(data_root: Path) -> Path:
    """The rendered gym with exact ground truth."""
    return data_root / "gym-a"
