"""What climbers and setters leave on the wall: chalk and rubber around holds, tags, T-nuts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walltopo.synth.bodies import Facet, GymInstance
from walltopo.synth.brush import Canvas, dots, noise_image
from walltopo.synth.tnuts import facet_tnuts

__all__ = ["chalk_halo", "tags", "tnut_holes"]


def tnut_holes(canvas: Canvas, facet: Facet, rng: np.random.Generator) -> None:
    uv = facet_tnuts(facet)
    if len(uv) == 0:
        return
    uv = uv + rng.normal(0, 0.0015, uv.shape)
    dots(canvas, uv, 0.0085, 0.30)
    dots(canvas, uv, 0.0055, 0.05)


def chalk_halo(
    canvas: Canvas, facet: Facet, holds: Sequence[GymInstance], amount: float,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Chalk and rubber around the holds: hands brush above them, feet scrape below."""
    import cv2

    h, w = canvas.image.shape[:2]
    chalk = np.zeros((h, w), np.float32)
    for hold in holds:
        assert hold.body is not None
        x, y = canvas.pixels(facet.chart(hold.position))
        reach = hold.body.radius / canvas.texel
        if not (-reach < x < w + reach and -reach < y < h + reach):
            continue
        for _ in range(int(rng.integers(1, 5))):
            spot = (int(x + rng.normal(0, reach)), int(y + rng.normal(0.4, 0.8) * reach))
            axes = (
                max(1, int(reach * rng.uniform(0.15, 0.6))),
                max(1, int(reach * rng.uniform(0.1, 0.3))),
            )
            strength = float(rng.uniform(0.1, 0.6))
            cv2.ellipse(chalk, spot, axes, float(rng.uniform(0, 180)), 0, 360, strength, -1)
    soft = max(0.02 / canvas.texel, 0.8)
    chalk = np.asarray(cv2.GaussianBlur(chalk, (0, 0), soft), np.float32)
    chalk *= amount * np.clip(0.8 + 0.5 * noise_image((h, w), (3, 3), rng), 0, 1.5)
    weight = np.clip(chalk, 0, 0.7)[..., None]
    canvas.image[...] = canvas.image * (1 - weight) + 0.93 * weight


def tags(
    canvas: Canvas, facet: Facet, holds: Sequence[GymInstance], rng: np.random.Generator
) -> None:
    """Printed tags and tape beside the holds a route starts at."""
    import cv2

    for hold in holds:
        if hold.role != "start" or hold.body is None:
            continue
        x, y = canvas.pixels(
            facet.chart(hold.position)
            + np.array([rng.uniform(-0.05, 0.05), -hold.body.radius - 0.04])
        )
        w, h = 0.075 / canvas.texel, 0.045 / canvas.texel
        box = cv2.boxPoints(((x, y), (w, h), float(rng.normal(0, 8))))
        cv2.fillConvexPoly(
            canvas.image, np.round(box).astype(np.int32), tuple(map(float, hold.rgb))
        )
        for k in (-0.2, 0.1):
            a = (int(x - 0.3 * w), int(y + k * h))
            b = (int(x + rng.uniform(0.0, 0.35) * w), int(y + k * h))
            ink = 0.95 if sum(hold.rgb) < 1.4 else 0.08
            cv2.line(canvas.image, a, b, (ink,) * 3, max(1, int(0.006 / canvas.texel)))
