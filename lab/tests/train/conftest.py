"""Walls with red discs on them: the smallest labelled set there is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest


def draw_discs(discs: list[tuple[int, int, int]], side: int = 240) -> np.ndarray:
    """A noisy grey wall with red discs (x, y, radius), BGR."""
    wall = np.full((side, side, 3), (150, 160, 165), np.uint8)
    for x, y, r in discs:
        cv2.circle(wall, (x, y), r, (40, 40, 200), -1)
    noise = np.random.default_rng(0).normal(0, 5, wall.shape)
    return np.clip(wall + noise, 0, 255).astype(np.uint8)


def make_yolo(folder: Path, count: int = 4) -> Path:
    """A small YOLO set of disc walls."""
    (folder / "images").mkdir(parents=True)
    (folder / "labels").mkdir()
    rng = np.random.default_rng(5)
    for n in range(count):
        discs = [
            (int(x), int(y), int(r))
            for x, y, r in zip(
                rng.integers(40, 200, 4), (40, 90, 140, 195), rng.integers(10, 22, 4), strict=True
            )
        ]
        cv2.imwrite(str(folder / "images" / f"wall{n}.png"), draw_discs(discs))
        rows = [
            f"0 {x / 240} {y / 240} {(2 * r + 1) / 240} {(2 * r + 1) / 240}" for x, y, r in discs
        ]
        (folder / "labels" / f"wall{n}.txt").write_text("\n".join(rows))
    return folder


@pytest.fixture
def disc_wall() -> Callable[..., np.ndarray]:
    return draw_discs


@pytest.fixture
def disc_set() -> Callable[..., Path]:
    return make_yolo
