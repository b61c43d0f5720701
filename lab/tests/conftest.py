"""Fixtures that several tests of the lab use."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that want Ultralytics, for `make test-ultralytics`."""
    for item in items:
        if "ultralytics" in getattr(item, "fixturenames", ()):
            item.add_marker("ultralytics")


@pytest.fixture(scope="session")
def ultralytics(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Ultralytics itself, kept from the network and from the home folder."""
    os.environ["YOLO_CONFIG_DIR"] = str(tmp_path_factory.mktemp("ultralytics"))
    os.environ["YOLO_OFFLINE"] = "true"
    return pytest.importorskip(
        "ultralytics", reason="AGPL-3.0, so not by default: make test-ultralytics"
    )


@pytest.fixture(scope="session")
def tiny_gym(once: Callable[..., Path]) -> Path:
    """A small rendered gym with its truth: `photos/` and `truth/`; nobody changes it."""
    from walltopo_lab.synth import write_tiny_gym

    return once("tiny-gym", write_tiny_gym)
