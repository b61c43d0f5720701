"""The course of a training run as an SVG picture."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from walltopo.core.files import atomic_path

__all__ = ["plot_history"]

_WIDTH, _HEIGHT, _EDGE = 640, 240, 44
_COLOURS = ("#c0392b", "#2471a3", "#1e8449", "#b9770e", "#6c3483")


def _panel(
    history: Sequence[Mapping[str, float]], keys: Sequence[str], title: str, top: int
) -> list[str]:
    """Lines of one panel: `keys` over minutes."""
    minutes = [h["minutes"] for h in history]
    values = [h[k] for h in history for k in keys if k in h and math.isfinite(h[k])]
    last, high = max([*minutes, 1e-6]), max([*values, 1e-6])
    inner_w, inner_h = _WIDTH - 2 * _EDGE, _HEIGHT - 2 * _EDGE

    def at(x: float, y: float) -> str:
        return f"{_EDGE + x / last * inner_w:.1f},{top + _HEIGHT - _EDGE - y / high * inner_h:.1f}"

    base = top + _HEIGHT - _EDGE
    lines = [
        f'<text x="{_EDGE}" y="{top + 18}" font-weight="bold">{title}</text>',
        f'<path d="M{at(0, high)} L{at(0, 0)} L{at(last, 0)}" fill="none" stroke="#555"/>',
        f'<text x="{_EDGE - 6}" y="{top + _EDGE + 4}" text-anchor="end">{high:.2f}</text>',
        f'<text x="{_EDGE - 6}" y="{base + 4}" text-anchor="end">0</text>',
        f'<text x="{_WIDTH - _EDGE}" y="{base + 16}" text-anchor="end">{last:.0f} min</text>',
    ]
    for k, key in enumerate(keys):
        points = [at(h["minutes"], h[key]) for h in history if math.isfinite(h.get(key, math.nan))]
        colour = _COLOURS[k % len(_COLOURS)]
        lines.append(
            f'<polyline points="{" ".join(points)}" fill="none" stroke="{colour}" '
            'stroke-width="2"/>'
        )
        lines.append(f'<text x="{190 + 110 * k}" y="{top + 18}" fill="{colour}">{key}</text>')
    return lines


def plot_history(history: Sequence[Mapping[str, float]], path: Path) -> None:
    """Write losses and held-out figures over time; `history` as in a run."""
    losses = [k for k in ("heat", "box", "mask") if any(k in h for h in history)]
    figures = [k for k in (history[0] if history else {}) if k.startswith("ap50")]
    body = _panel(history, losses, "training loss", 0)
    body += _panel(history, figures, "held-out AP50", _HEIGHT)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH}" height="{2 * _HEIGHT}" '
        'font-family="sans-serif" font-size="12">'
    )
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join([head, *body, "</svg>"]) + "\n", encoding="utf-8")
