"""The status page of an endless run: metrics over the processor hours spent."""

from __future__ import annotations

import html
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from walltopo.core.files import atomic_path
from walltopo_lab.plots import make_panels

Entry = Mapping[str, float]

_PANELS = {
    "boxes, AP50": ("score", "ap50_hold", "ap50_volume", "ap50"),
    "masks of drawn outlines, AP50": ("mask50", "mask50_hold", "mask50_volume"),
    "training loss": ("heat", "box", "mask"),
}
_NAMES = {
    "score": "boxes, mean of classes",
    "ap50_hold": "boxes, hold",
    "ap50_volume": "boxes, volume",
    "ap50": "boxes, classes as one",
    "mask50": "masks, mean of classes",
    "mask50_hold": "masks, hold",
    "mask50_volume": "masks, volume",
}


def _plot(history: Sequence[Entry]) -> str:
    figure, axes = make_panels(len(_PANELS), columns=3)
    for axis, (title, keys) in zip(axes, _PANELS.items(), strict=True):
        for key in keys:
            rows = [row for row in history if key in row]
            hours = [row["core_hours"] for row in rows]
            axis.plot(hours, [row[key] for row in rows], marker=".", label=_NAMES.get(key, key))
        if history:
            axis.axvline(history[0]["core_hours"], color="0.6", linestyle=":")
        axis.set(title=title, xlabel="core-hours", xlim=(0, None))
        if axis.get_legend_handles_labels()[1]:
            axis.legend()
    text = io.StringIO()
    figure.savefig(text, format="svg")
    return text.getvalue()[text.getvalue().index("<svg") :]


def _table(history: Sequence[Entry]) -> str:
    keys = [key for key in (*_NAMES, "heat", "box", "mask") if any(key in row for row in history)]
    heads = ["core-hours", "steps", *(_NAMES.get(key, f"loss, {key}") for key in keys)]
    lines = ["<tr>" + "".join(f"<th>{html.escape(head)}</th>" for head in heads) + "</tr>"]
    for row in reversed(history):
        cells = [f"{row['core_hours']:.2f}", f"{row['step']:,.0f}"]
        cells += [f"{row[key]:.3f}" if key in row else "" for key in keys]
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return "<table>" + "\n".join(lines) + "</table>"


def write_page(path: Path, history: Sequence[Entry]) -> None:
    """Write the status page; `history` as in `Run`."""
    text = f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Training of the detector</title>
<style>body {{ font: 15px sans-serif; margin: 2em }}
td, th {{ padding: .2em .7em; text-align: right }}
svg {{ max-width: 100%; height: auto }}</style></head><body>
<h1>Training of the detector</h1>
<p>Figures of the averaged weights on the photos of the quick check, one look. The hours before
the dotted line are those of the shipped network that this run began with; they are estimated.</p>
{_plot(history)}
{_table(history)}
</body></html>
"""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
