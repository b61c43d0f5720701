"""The examples in docstrings do what they say."""

from __future__ import annotations

import doctest
import importlib

import pytest

MODULES = (
    "walltopo.core.instances",
    "walltopo.core.mesh",
    "walltopo.core.view",
    "walltopo.segment.lift",
    "walltopo.pipeline.settings",
)


@pytest.mark.parametrize("name", MODULES)
def test_examples(name: str) -> None:
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert tried > 0
    assert failed == 0
