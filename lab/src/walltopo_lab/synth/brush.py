"""Brushes for the bitmaps of plane surfaces: noise, veneer, dots, seams, smears, letters.

A canvas is (h, w, 3) float32 sRGB 0..1; its row 0 is the facet's lowest v.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Canvas:
    """The bitmap of a facet during painting.

    Parameters
    ----------
    image : (h, w, 3) float32 sRGB.
    low : (2,) chart coordinates of the image's corner (0, 0), metres.
    texel : metres.
    """

    image: Image
    low: NDArray[np.float64]
    texel: float

    def pixels(self, uv: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return image coordinates (x, y) of chart coordinates in metres."""
        return np.asarray((uv - self.low) / self.texel)


def noise_image(
    shape: tuple[int, int], cell: tuple[float, float], rng: np.random.Generator
) -> Image:
    """Return smooth noise of unit spread; `cell` is the bump size (rows, columns) in texels."""
    import cv2

    rows, columns = (
        max(2, int(np.ceil(n / max(c, 1.0)))) for n, c in zip(shape, cell, strict=True)
    )
    coarse = rng.standard_normal((rows, columns), dtype=np.float32)
    if (rows, columns) == shape:
        return coarse
    return np.asarray(cv2.resize(coarse, shape[::-1], interpolation=cv2.INTER_CUBIC), np.float32)


def add_speckle(canvas: Canvas, rng: np.random.Generator, fine: float, coarse: float) -> None:
    """Add roller texture, stains and unevenness at sizes from a texel to half a metre."""
    shape = canvas.image.shape[:2]
    per_metre = 1.0 / canvas.texel
    field = fine * noise_image(shape, (1.0, 1.0), rng)
    field += fine * noise_image(shape, (2.4, 2.4), rng)
    for metres, weight in ((0.02, 0.9), (0.06, 0.8), (0.2, 0.8), (0.6, 1.0)):
        cell = metres * per_metre
        field += coarse * weight * noise_image(shape, (cell, cell), rng)
    canvas.image[...] *= (1.0 + field)[..., None]


def paint_plywood(
    canvas: Canvas, rng: np.random.Generator, tone: tuple[float, float, float]
) -> None:
    """Paint veneer: growth rings cut lengthwise, pores, boards of different tone."""
    h, w = canvas.image.shape[:2]
    warp = noise_image((h, w), (0.35 / canvas.texel, 1.2 / canvas.texel), rng) * 0.13
    v = (np.arange(h, dtype=np.float32) * canvas.texel)[:, None] + warp
    rings = np.sin(v * 2 * np.pi / 0.055) * 0.5 + np.sin(v * 2 * np.pi / 0.021 + 1.7) * 0.3
    pores = noise_image((h, w), (1.0, 14.0), rng)
    field = 1.0 + 0.06 * rings + 0.045 * pores
    light, dark = np.array(tone, np.float32), np.array(tone, np.float32) * (0.86, 0.78, 0.68)
    blend = np.clip(0.5 - 0.35 * rings, 0, 1)[..., None]
    canvas.image[...] = (light * (1 - blend) + dark * blend) * field[..., None]


def draw_dots(canvas: Canvas, uv: NDArray[np.float64], radius: float, colour: float) -> None:
    import cv2

    for x, y in canvas.pixels(uv):
        centre = (round((x - 0.5) * 16), round((y - 0.5) * 16))
        size = max(round(radius / canvas.texel * 16), 10)
        cv2.circle(canvas.image, centre, size, (colour,) * 3, -1, cv2.LINE_AA, 4)


def draw_seams(canvas: Canvas, rng: np.random.Generator) -> None:
    """Draw the edges of the plywood sheets (1.22 x 2.44 m) and the screws along them."""
    import cv2

    h, w = canvas.image.shape[:2]
    screws = []
    for size, extent, upright in ((2.44, w, True), (1.22, h, False)):
        start = rng.uniform(0.2, 0.8) * size
        for at in np.arange(start, extent * canvas.texel, size):
            p = round(at / canvas.texel * 16)
            a, b = ((p, 0), (p, h * 16)) if upright else ((0, p), (w * 16, p))
            cv2.line(canvas.image, a, b, (0.16, 0.15, 0.14), 1, cv2.LINE_AA, 4)
            along = np.arange(0.1, (h if upright else w) * canvas.texel, 0.31)
            for side in (-0.018, 0.018):
                s = np.full(len(along), at + side)
                screws.append(np.stack([s, along] if upright else [along, s], axis=1))
    if screws:
        draw_dots(canvas, np.concatenate(screws) + canvas.low, 0.004, 0.42)


def draw_strokes(
    canvas: Canvas,
    rng: np.random.Generator,
    count: int,
    colour: float,
    length: tuple[float, float],
    blur: float,
    strength: float,
) -> None:
    """Draw random smears: shoe rubber (dark) or chalk (light)."""
    import cv2

    h, w = canvas.image.shape[:2]
    layer = np.zeros((h, w), np.float32)
    for _ in range(count):
        x, y = rng.uniform(0, w), rng.uniform(0, h)
        angle, reach = rng.normal(np.pi / 2, 0.7), rng.uniform(*length) / canvas.texel
        bend = rng.normal(0, 0.25)
        mid = (x + reach / 2 * np.cos(angle), y + reach / 2 * np.sin(angle))
        end = (
            mid[0] + reach / 2 * np.cos(angle + bend),
            mid[1] + reach / 2 * np.sin(angle + bend),
        )
        points = np.array([(x, y), mid, end]) * 16
        thick = int(rng.integers(1, max(2, round(0.02 / canvas.texel))))
        cv2.polylines(
            layer,
            [points.astype(np.int32)],
            False,
            float(rng.uniform(0.2, 1)),
            thick,
            cv2.LINE_AA,
            4,
        )
    if blur > 0:
        layer = np.asarray(cv2.GaussianBlur(layer, (0, 0), blur / canvas.texel), np.float32)
    layer *= strength * (0.65 + 0.35 * np.clip(noise_image((h, w), (2, 2), rng), -1, 1))
    weight = np.clip(layer, 0, 0.85)[..., None]
    canvas.image[...] = canvas.image * (1 - weight) + colour * weight


def paint_letters(canvas: Canvas, rng: np.random.Generator) -> None:
    """Paint a word of random letters, because many gyms paint their name on the wall."""
    import cv2

    h, w = canvas.image.shape[:2]
    word = "".join(rng.choice(list("ABDEGKLMORSTUVW"), int(rng.integers(3, 7))))
    scale = min(0.32 / canvas.texel / 22, w / (22 * len(word)) * 0.8)
    stencil = np.zeros((h, w), np.uint8)
    place = (int(rng.uniform(0.05, 0.4) * w), int(rng.uniform(0.4, 0.7) * h))
    thick = max(2, int(scale * 5))
    cv2.putText(stencil, word, place, cv2.FONT_HERSHEY_SIMPLEX, scale, 255, thick, cv2.LINE_AA)
    layer = (stencil[::-1, :, None] / 255.0).astype(np.float32)  # row 0 is the lowest
    ink = np.array(rng.choice([0.1, 0.88, 0.5]) + rng.uniform(-0.08, 0.08, 3), np.float32)
    canvas.image[...] = canvas.image * (1 - layer) + ink * layer
