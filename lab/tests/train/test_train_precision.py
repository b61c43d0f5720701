"""Training uses bfloat16 only where the CPU computes it faster."""

from __future__ import annotations

import pytest
import torch

from walltopo_lab.train import precision


@pytest.mark.parametrize(("faster", "kind"), [(True, torch.bfloat16), (False, torch.float32)])
def test_the_faster_format_is_used(
    monkeypatch: pytest.MonkeyPatch, faster: bool, kind: torch.dtype
) -> None:
    monkeypatch.setattr(precision, "_bfloat16_is_faster", lambda: faster)
    layer = torch.nn.Conv2d(3, 4, 3)
    with precision.fast_autocast(torch.device("cpu")):
        assert layer(torch.rand(1, 3, 8, 8)).dtype == kind


def test_the_measurement_decides_once() -> None:
    assert precision._bfloat16_is_faster() in (True, False)
    assert precision._bfloat16_is_faster.cache_info().currsize == 1
