"""Small pieces of HTML. Everything that comes from a scan passes `text`, so it stays text."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import Any

__all__ = ["bars", "card", "figure", "number", "section", "table", "text"]


def text(value: Any) -> str:
    """A value as escaped text."""
    return html.escape(str(value))


def number(value: Any, digits: int = 1, unit: str = "") -> str:
    """A figure with its unit, an en dash where there is none."""
    if not isinstance(value, (int, float)) or isinstance(value, bool) or value != value:
        return "–"
    shown = f"{value:,.{digits}f}" if isinstance(value, float) else f"{value:,}"
    return f"{shown} {unit}".rstrip()


def section(title: str, body: str) -> str:
    return f"<section><h2>{text(title)}</h2>{body}</section>"


def card(value: str, label: str, tone: str = "") -> str:
    """A figure with its label; tone "good", "warn" or none (told by a sign too)."""
    sign = {"good": "✓ ", "warn": "! "}.get(tone, "")
    return f'<div class="card {tone}"><b>{sign}{text(value)}</b><span>{text(label)}</span></div>'


def figure(image: str, caption: str, overlay: str = "", size: tuple[int, int] = (1, 1)) -> str:
    """A picture (a data: address) with SVG drawn over it; `caption` is HTML."""
    width, height = size
    alt = text(caption.split(".")[0])
    drawing = (
        f'<svg viewBox="0 0 {width} {height}" preserveAspectRatio="none" aria-hidden="true">'
        f"{overlay}</svg>"
        if overlay
        else ""
    )
    return (
        f'<figure><div class="sheet"><img src="{image}" alt="{alt}" width="{width}" '
        f'height="{height}">{drawing}</div><figcaption>{caption}</figcaption></figure>'
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] = ()) -> str:
    """A table; cells are HTML already, `right` names the columns that hold figures."""

    def cells(values: Sequence[str], tag: str) -> str:
        return "".join(
            f'<{tag} class="n">{v}</{tag}>' if k in right else f"<{tag}>{v}</{tag}>"
            for k, v in enumerate(values)
        )

    body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
    heading = cells([text(name) for name in head], "th")
    return (
        f'<div class="wide" tabindex="0"><table><thead><tr>{heading}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def bars(share: float) -> str:
    """A bar of a share from 0 to 1."""
    return f'<span class="bar"><i style="width:{100 * min(max(share, 0.0), 1.0):.1f}%"></i></span>'
