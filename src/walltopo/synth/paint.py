"""Bitmaps of the plane surfaces: paint, plywood, T-nuts, seams, scuffs, chalk, mats, concrete.

A painter takes a canvas (h, w, 3) float32 sRGB 0..1, whose row 0 is the facet's lowest v.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.synth.bodies import Facet, GymInstance
from walltopo.synth.measure import plate_image
from walltopo.synth.params import GymSettings
from walltopo.synth.tnuts import facet_tnuts

__all__ = ["Canvas", "paint_facet"]

Image = NDArray[np.float32]

# Two or three paints a gym, sRGB; the first is the commonest.
_SCHEMES = (
    ((0.80, 0.77, 0.70), (0.70, 0.44, 0.30), (0.29, 0.37, 0.52)),
    ((0.63, 0.64, 0.66), (0.33, 0.35, 0.38), (0.80, 0.79, 0.76)),
    ((0.84, 0.82, 0.77), (0.42, 0.58, 0.62), (0.86, 0.66, 0.34)),
    ((0.72, 0.58, 0.40), (0.60, 0.40, 0.26), (0.78, 0.68, 0.52)),
    ((0.85, 0.85, 0.84), (0.77, 0.78, 0.79), (0.47, 0.60, 0.48)),
)


@dataclass(frozen=True, eq=False)
class Canvas:
    """A facet being painted.

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
        """Image coordinates (x, y) of chart coordinates in metres."""
        return np.asarray((uv - self.low) / self.texel)


def noise_image(
    shape: tuple[int, int], cell: tuple[float, float], rng: np.random.Generator
) -> Image:
    """Smooth noise of unit spread; `cell` is the size of a bump (rows, columns) in texels."""
    import cv2

    rows, columns = (
        max(2, int(np.ceil(n / max(c, 1.0)))) for n, c in zip(shape, cell, strict=True)
    )
    coarse = rng.standard_normal((rows, columns), dtype=np.float32)
    if (rows, columns) == shape:
        return coarse
    return np.asarray(cv2.resize(coarse, shape[::-1], interpolation=cv2.INTER_CUBIC), np.float32)


def _speckle(canvas: Canvas, rng: np.random.Generator, fine: float, coarse: float) -> None:
    """Roller texture, stains and unevenness at sizes from a texel to half a metre."""
    shape = canvas.image.shape[:2]
    per_metre = 1.0 / canvas.texel
    field = fine * noise_image(shape, (1.0, 1.0), rng)
    field += fine * noise_image(shape, (2.4, 2.4), rng)
    for metres, weight in ((0.02, 0.9), (0.06, 0.8), (0.2, 0.8), (0.6, 1.0)):
        cell = metres * per_metre
        field += coarse * weight * noise_image(shape, (cell, cell), rng)
    canvas.image[...] *= (1.0 + field)[..., None]


def _plywood(canvas: Canvas, rng: np.random.Generator, tone: tuple[float, float, float]) -> None:
    """Veneer: growth rings cut lengthwise, pores, boards of different tone."""
    h, w = canvas.image.shape[:2]
    warp = noise_image((h, w), (0.35 / canvas.texel, 1.2 / canvas.texel), rng) * 0.13
    v = (np.arange(h, dtype=np.float32) * canvas.texel)[:, None] + warp
    rings = np.sin(v * 2 * np.pi / 0.055) * 0.5 + np.sin(v * 2 * np.pi / 0.021 + 1.7) * 0.3
    pores = noise_image((h, w), (1.0, 14.0), rng)
    field = 1.0 + 0.06 * rings + 0.045 * pores
    light, dark = np.array(tone, np.float32), np.array(tone, np.float32) * (0.86, 0.78, 0.68)
    blend = np.clip(0.5 - 0.35 * rings, 0, 1)[..., None]
    canvas.image[...] = (light * (1 - blend) + dark * blend) * field[..., None]


def _shapes(
    canvas: Canvas, rng: np.random.Generator, scheme: Sequence[tuple[float, float, float]]
) -> None:
    """One paint, and on some facets a second along a slanting line."""
    h, w = canvas.image.shape[:2]
    first = int(rng.choice(len(scheme), p=(0.62, 0.2, 0.18)))
    canvas.image[...] = np.array(scheme[first], np.float32) * rng.uniform(0.96, 1.03)
    if rng.random() < 0.45:
        second = np.array(scheme[int(rng.integers(len(scheme)))], np.float32)
        angle, y, x = rng.uniform(0, 2 * np.pi), *np.indices((h, w), dtype=np.float32)
        split = rng.uniform(0.3, 0.7)
        side = (x - split * w) * np.cos(angle) + (y - split * h) * np.sin(angle)
        canvas.image[side > 0] = second


def _dots(canvas: Canvas, uv: NDArray[np.float64], radius: float, colour: float) -> None:
    import cv2

    for x, y in canvas.pixels(uv):
        centre = (round((x - 0.5) * 16), round((y - 0.5) * 16))
        size = max(round(radius / canvas.texel * 16), 10)
        cv2.circle(canvas.image, centre, size, (colour,) * 3, -1, cv2.LINE_AA, 4)


def _tnut_holes(canvas: Canvas, facet: Facet, rng: np.random.Generator) -> None:
    uv = facet_tnuts(facet)
    if len(uv) == 0:
        return
    uv = uv + rng.normal(0, 0.0015, uv.shape)
    _dots(canvas, uv, 0.0085, 0.30)
    _dots(canvas, uv, 0.0055, 0.05)


def _seams(canvas: Canvas, rng: np.random.Generator) -> None:
    """Edges of the plywood sheets (1.22 x 2.44 m) and the screws along them."""
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
        _dots(canvas, np.concatenate(screws) + canvas.low, 0.004, 0.42)


def _strokes(
    canvas: Canvas,
    rng: np.random.Generator,
    count: int,
    colour: float,
    length: tuple[float, float],
    blur: float,
    strength: float,
) -> None:
    """Smears at random: shoe rubber (dark) or chalk (light)."""
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


def _chalk_halo(
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


def _tags(
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


def _wall(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    settings = work.settings
    scheme = _SCHEMES[work.scheme % len(_SCHEMES)]
    if settings.finish == "plywood":
        tone = np.array((0.70, 0.54, 0.36)) * rng.uniform(0.85, 1.08)
        _plywood(canvas, rng, (*map(float, tone),))  # type: ignore[arg-type]
        _speckle(canvas, rng, 0.02, 0.03)
    else:
        _shapes(canvas, rng, scheme)
        rough = 0.075 if settings.finish == "textured" else 0.035
        _speckle(canvas, rng, rough, 0.018 + 0.02 * settings.wear)
    _seams(canvas, rng)
    area = canvas.image.shape[0] * canvas.image.shape[1] * canvas.texel**2
    _strokes(canvas, rng, int(area * 9 * settings.wear), 0.10, (0.02, 0.16), 0.0012, 0.55)
    _strokes(canvas, rng, int(area * 4 * settings.wear), 0.12, (0.05, 0.35), 0.006, 0.5)
    _strokes(canvas, rng, int(area * 5 * settings.chalk), 0.93, (0.04, 0.2), 0.008, 0.7)
    _chalk_halo(canvas, facet, work.holds, 0.9 * settings.chalk, rng)
    _tnut_holes(canvas, facet, rng)
    _tags(canvas, facet, [h for h in work.holds if facet.inside(h.position) > 0], rng)


def _volume(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    record = work.volumes[facet.instance]
    if record.colour == "wood":
        _plywood(canvas, rng, record.rgb)
        _speckle(canvas, rng, 0.02, 0.02)
    else:
        canvas.image[...] = np.array(record.rgb, np.float32)
        _speckle(canvas, rng, 0.05, 0.03)
    area = canvas.image.shape[0] * canvas.image.shape[1] * canvas.texel**2
    wear = work.settings.wear
    _strokes(canvas, rng, int(area * 30 * wear) + 2, 0.14, (0.02, 0.12), 0.0012, 0.5)
    _strokes(canvas, rng, int(area * 14 * work.settings.chalk) + 1, 0.92, (0.03, 0.15), 0.01, 0.8)
    _tnut_holes(canvas, facet, rng)


def _floor(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    """Mats of vinyl, 2 x 1 m, with seams; footprints and chalk."""
    import cv2

    h, w = canvas.image.shape[:2]
    base = np.array(
        ((0.20, 0.26, 0.42), (0.28, 0.28, 0.30), (0.34, 0.20, 0.20))[work.scheme % 3], np.float32
    )
    for j, y in enumerate(range(0, h, round(1.0 / canvas.texel))):
        for x in range(-(j % 2) * round(1.0 / canvas.texel), w, round(2.0 / canvas.texel)):
            tone = base * np.float32(rng.uniform(0.86, 1.12))
            x1, y1 = x + round(2.0 / canvas.texel), y + round(1.0 / canvas.texel)
            canvas.image[y:y1, max(x, 0) : x1] = tone
            cv2.rectangle(canvas.image, (x, y), (x1, y1), (0.05, 0.05, 0.06), 2)
    _speckle(canvas, rng, 0.07, 0.05)
    area = h * w * canvas.texel**2
    _strokes(canvas, rng, int(area * 5), 0.60, (0.03, 0.25), 0.006, 0.5)
    _strokes(canvas, rng, int(area * 5), 0.07, (0.03, 0.3), 0.002, 0.5)


def _concrete(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    import cv2

    h, w = canvas.image.shape[:2]
    tone = (0.42, 0.50, 0.30)[(work.scheme + facet.style) % 3]
    canvas.image[...] = tone * np.array((1.0, 0.97, 0.92), np.float32)
    _speckle(canvas, rng, 0.07, 0.06)
    step = 0.5 / canvas.texel
    for k in range(int(h / step) + 1):
        cv2.line(canvas.image, (0, int(k * step)), (w, int(k * step)), (0.2, 0.2, 0.2), 1)
        for x in np.arange((k % 2) * step, w, 2 * step):
            a, b = (int(x), int(k * step)), (int(x), int((k + 1) * step))
            cv2.line(canvas.image, a, b, (0.2, 0.2, 0.2), 1)


def _ceiling(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    import cv2

    h, w = canvas.image.shape[:2]
    canvas.image[...] = 0.20
    _speckle(canvas, rng, 0.05, 0.05)
    for x in np.arange(0.6, w * canvas.texel, 1.9):
        p = int(x / canvas.texel)
        cv2.rectangle(
            canvas.image, (p, 0), (p + int(0.18 / canvas.texel), h), (0.34, 0.33, 0.3), -1
        )
    for y in np.arange(0.9, h * canvas.texel, 1.5):
        p = int(y / canvas.texel)
        cv2.line(canvas.image, (0, p), (w, p), (0.1, 0.1, 0.11), max(1, int(0.07 / canvas.texel)))


def _plate(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    import cv2

    h, w = canvas.image.shape[:2]
    print_ = plate_image(facet.style)[::-1].astype(np.float32) / 255  # row 0 is the lowest v
    resized = cv2.resize(print_, (w, h), interpolation=cv2.INTER_NEAREST)
    canvas.image[...] = resized[..., None]


@dataclass(frozen=True, eq=False)
class PaintWork:
    """What painters may look at: settings, colour scheme, what is bolted where."""

    settings: GymSettings
    scheme: int
    holds: Sequence[GymInstance]
    volumes: dict[int, GymInstance]


_PAINTERS: dict[str, Callable[[Canvas, Facet, PaintWork, np.random.Generator], None]] = {
    "wall": _wall,
    "volume": _volume,
    "floor": _floor,
    "concrete": _concrete,
    "ceiling": _ceiling,
    "plate": _plate,
}


def paint_facet(facet: Facet, work: PaintWork, rng: np.random.Generator) -> Canvas:
    """The bitmap of one facet, clipped to 0..1."""
    uv = facet.chart(facet.corners)
    margin = 0 if facet.kind == "plate" else facet.texel
    low, high = uv.min(axis=0) - margin, uv.max(axis=0) + margin
    size = np.maximum(np.round((high - low) / facet.texel).astype(int), 1)
    image = np.zeros((size[1], size[0], 3), np.float32)
    canvas = Canvas(image, low, facet.texel)
    _PAINTERS[facet.kind](canvas, facet, work, rng)
    np.clip(image, 0, 1, out=image)
    return canvas
