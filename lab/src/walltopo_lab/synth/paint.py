"""Painters for each kind of plane surface: panels, volumes, mats, building, scale plate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from walltopo_lab.synth.bodies import PRINTS, Facet, GymInstance
from walltopo_lab.synth.brush import (
    Canvas,
    add_speckle,
    draw_seams,
    draw_strokes,
    paint_letters,
    paint_plywood,
)
from walltopo_lab.synth.marks import Tag, chalk_halo, tags, tnut_holes
from walltopo_lab.synth.measure import plate_image
from walltopo_lab.synth.params import GymSettings
from walltopo_lab.synth.stickers import sticker_image

# Paints of each gym, sRGB; the first is the most frequent.
_SCHEMES = (
    ((0.80, 0.77, 0.70), (0.70, 0.44, 0.30), (0.29, 0.37, 0.52)),
    ((0.63, 0.64, 0.66), (0.33, 0.35, 0.38), (0.80, 0.79, 0.76)),
    ((0.84, 0.82, 0.77), (0.42, 0.58, 0.62), (0.86, 0.66, 0.34)),
    ((0.72, 0.58, 0.40), (0.60, 0.40, 0.26), (0.78, 0.68, 0.52)),
    ((0.85, 0.85, 0.84), (0.77, 0.78, 0.79), (0.47, 0.60, 0.48)),
)


def _paint_shapes(
    canvas: Canvas, rng: np.random.Generator, scheme: Sequence[tuple[float, float, float]]
) -> None:
    """Paint one colour, and on some facets a second beyond a slanting line."""
    h, w = canvas.image.shape[:2]
    first = int(rng.choice(len(scheme), p=(0.62, 0.2, 0.18)))
    canvas.image[...] = np.array(scheme[first], np.float32) * rng.uniform(0.96, 1.03)
    if rng.random() < 0.45:
        second = np.array(scheme[int(rng.integers(len(scheme)))], np.float32)
        angle, y, x = rng.uniform(0, 2 * np.pi), *np.indices((h, w), dtype=np.float32)
        split = rng.uniform(0.3, 0.7)
        side = (x - split * w) * np.cos(angle) + (y - split * h) * np.sin(angle)
        canvas.image[side > 0] = second


def _paint_wall(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    settings = work.settings
    scheme = _SCHEMES[work.scheme % len(_SCHEMES)]
    if settings.finish == "plywood":
        tone = np.array((0.70, 0.54, 0.36)) * rng.uniform(0.85, 1.08)
        paint_plywood(canvas, rng, (*map(float, tone),))  # type: ignore[arg-type]
        add_speckle(canvas, rng, 0.02, 0.03)
    else:
        _paint_shapes(canvas, rng, scheme)
        rough = 0.075 if settings.finish == "textured" else 0.035
        add_speckle(canvas, rng, rough, 0.018 + 0.02 * settings.wear)
    if rng.random() < 0.07:
        paint_letters(canvas, rng)
    draw_seams(canvas, rng)
    area = canvas.image.shape[0] * canvas.image.shape[1] * canvas.texel**2
    draw_strokes(canvas, rng, int(area * 9 * settings.wear), 0.10, (0.02, 0.16), 0.0012, 0.55)
    draw_strokes(canvas, rng, int(area * 4 * settings.wear), 0.12, (0.05, 0.35), 0.006, 0.5)
    draw_strokes(canvas, rng, int(area * 5 * settings.chalk), 0.93, (0.04, 0.2), 0.008, 0.7)
    here = [hold for hold in work.holds if facet.carries(hold.position)]
    tnut_holes(canvas, facet, rng)
    # Draw route-dependent marks last, so that a reset leaves the rest unchanged.
    chalk_halo(canvas, facet, here, 0.9 * settings.chalk, rng)
    work.tags.extend(tags(canvas, facet, here, rng))


def _paint_volume(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    record = work.volumes[facet.instance]
    if record.colour == "wood":
        paint_plywood(canvas, rng, record.rgb)
        add_speckle(canvas, rng, 0.02, 0.02)
    else:
        canvas.image[...] = np.array(record.rgb, np.float32)
        add_speckle(canvas, rng, 0.05, 0.03)
    area = canvas.image.shape[0] * canvas.image.shape[1] * canvas.texel**2
    wear = work.settings.wear
    draw_strokes(canvas, rng, int(area * 30 * wear) + 2, 0.14, (0.02, 0.12), 0.0012, 0.5)
    draw_strokes(
        canvas, rng, int(area * 14 * work.settings.chalk) + 1, 0.92, (0.03, 0.15), 0.01, 0.8
    )
    tnut_holes(canvas, facet, rng)


def _paint_dome(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    """Paint a patch of a round volume: gelcoat, with shoe rubber and chalk on some patches."""
    canvas.image[...] = np.array(work.volumes[facet.instance].rgb, np.float32)
    add_speckle(canvas, rng, 0.03, 0.02)
    patch = canvas.image.shape[0] * canvas.image.shape[1] * canvas.texel**2
    scuffs, smears = rng.poisson(
        patch * np.array([60 * work.settings.wear, 30 * work.settings.chalk])
    )
    draw_strokes(canvas, rng, int(scuffs), 0.14, (0.02, 0.12), 0.0012, 0.5)
    draw_strokes(canvas, rng, int(smears), 0.92, (0.03, 0.15), 0.01, 0.8)


def _paint_floor(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    """Paint vinyl mats of 2 x 1 m with seams, footprints and chalk."""
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
    add_speckle(canvas, rng, 0.07, 0.05)
    area = h * w * canvas.texel**2
    draw_strokes(canvas, rng, int(area * 5), 0.60, (0.03, 0.25), 0.006, 0.5)
    draw_strokes(canvas, rng, int(area * 5), 0.07, (0.03, 0.3), 0.002, 0.5)


def _paint_concrete(
    canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator
) -> None:
    import cv2

    h, w = canvas.image.shape[:2]
    tone = (0.42, 0.50, 0.30)[(work.scheme + facet.style) % 3]
    canvas.image[...] = tone * np.array((1.0, 0.97, 0.92), np.float32)
    add_speckle(canvas, rng, 0.07, 0.06)
    step = 0.5 / canvas.texel
    for k in range(int(h / step) + 1):
        cv2.line(canvas.image, (0, int(k * step)), (w, int(k * step)), (0.2, 0.2, 0.2), 1)
        for x in np.arange((k % 2) * step, w, 2 * step):
            a, b = (int(x), int(k * step)), (int(x), int((k + 1) * step))
            cv2.line(canvas.image, a, b, (0.2, 0.2, 0.2), 1)


def _paint_ceiling(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    import cv2

    h, w = canvas.image.shape[:2]
    canvas.image[...] = 0.20
    add_speckle(canvas, rng, 0.05, 0.05)
    for x in np.arange(0.6, w * canvas.texel, 1.9):
        p = int(x / canvas.texel)
        cv2.rectangle(
            canvas.image, (p, 0), (p + int(0.18 / canvas.texel), h), (0.34, 0.33, 0.3), -1
        )
    for y in np.arange(0.9, h * canvas.texel, 1.5):
        p = int(y / canvas.texel)
        cv2.line(canvas.image, (0, p), (w, p), (0.1, 0.1, 0.11), max(1, int(0.07 / canvas.texel)))


def _paint_plate(canvas: Canvas, facet: Facet, work: PaintWork, rng: np.random.Generator) -> None:
    import cv2

    h, w = canvas.image.shape[:2]
    image = plate_image if facet.kind == "plate" else sticker_image
    print_ = image(facet.style)[::-1].astype(np.float32) / 255  # row 0 is the lowest v
    resized = cv2.resize(print_, (w, h), interpolation=cv2.INTER_NEAREST)
    canvas.image[...] = resized[..., None]


@dataclass(frozen=True, eq=False)
class PaintWork:
    """The painters' input: settings, colour scheme, and the holds and volumes.

    `tags` is an output: painters append the start tags that they draw.
    """

    settings: GymSettings
    scheme: int
    holds: Sequence[GymInstance]
    volumes: dict[int, GymInstance]
    tags: list[Tag] = field(default_factory=list)


_PAINTERS: dict[str, Callable[[Canvas, Facet, PaintWork, np.random.Generator], None]] = {
    "wall": _paint_wall,
    "fin": _paint_wall,
    "volume": _paint_volume,
    "dome": _paint_dome,
    "floor": _paint_floor,
    "concrete": _paint_concrete,
    "ceiling": _paint_ceiling,
    "plate": _paint_plate,
    "sticker": _paint_plate,
}


def paint_facet(facet: Facet, work: PaintWork, rng: np.random.Generator) -> Canvas:
    """Return the bitmap of one facet, clipped to 0..1."""
    uv = facet.chart(facet.corners)
    margin = 0 if facet.kind in PRINTS else facet.texel
    low, high = uv.min(axis=0) - margin, uv.max(axis=0) + margin
    size = np.maximum(np.round((high - low) / facet.texel).astype(int), 1)
    image = np.zeros((size[1], size[0], 3), np.float32)
    canvas = Canvas(image, low, facet.texel)
    _PAINTERS[facet.kind](canvas, facet, work, rng)
    np.clip(image, 0, 1, out=image)
    return canvas
