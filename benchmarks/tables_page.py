"""The page docs/results.md, from the figures that `benchmarks.tables` keeps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.results import Part
from benchmarks.tables_lift import PRESETS
from walltopo.core.files import atomic_path

# Quoted from the method's publication, on another gym, so for orientation only.
QUOTED = {
    "modern gym": (
        ("the published method, tuned", 75.9, 33.2, 81.4),
        ("OneFormer3D", 16.2, 6.0, 57.8),
        ("PointTransformer", 19.7, 7.3, 78.1),
    ),
    "old gym": (
        ("the published method, tuned", 66.0, 26.1, 71.8),
        ("OneFormer3D", 3.2, 1.0, 22.5),
        ("PointTransformer", 3.2, 1.4, 41.8),
    ),
}
TARGETS = {"instance mAP50": 0.80, "instance mAP": 0.45, "semantic mIoU": 0.85, "route ARI": 0.95}


def write_page(path: Path, parts: Mapping[str, Part]) -> None:
    """Write the page; it names a missing part as not run."""
    lines = [
        "# Results",
        "",
        "Written by `python -m benchmarks.tables`; not edited by hand.",
        "",
    ]
    for number, (name, title, body) in enumerate(
        (
            ("labels", "Labels from a painted mesh against true masks", _labels),
            ("detectors", "The shipped detector on photos it never saw", _detectors),
            ("lift", "3D instances and semantics on generated gyms", _lift),
            ("given", "The lift alone, on the masks that `gym-a` comes with", _given),
            ("routes", "Routes, with true holds and colours", _routes),
            ("endtoend", "`gym-a` from photos alone", _end_to_end),
        ),
        start=1,
    ):
        lines += [f"## {number}. {title}", ""]
        if name not in parts:
            lines += ["Not run yet.", ""]
            continue
        part = parts[name]
        lines += body(part.figures, part.setup)
        when = f"{part.measured.date}, {part.measured.version} ({part.measured.revision})"
        done = "Copied from the page as it stood on" if part.transcribed else "Measured"
        lines += [
            f"Took {part.took['seconds']:.0f} s ({part.took['cpu_seconds']:.0f} CPU-s). "
            f"{done} {when}.{' ' * bool(part.note)}{part.note}",
            "",
        ]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines), encoding="utf-8")


def _three(value: Any) -> str:
    return "-" if value is None else f"{value:.3f}"


def _labels(figures: Mapping[str, Any], setup: Mapping[str, Any]) -> list[str]:
    lines = [
        f"{figures['photos']} photos of `gym-a`. The painted mesh is `gym-a/lift`'s, fused from "
        "noisy depth, so its edges are off by millimetres; the truth is the exact mesh drawn "
        "through the exact cameras. Published for comparison (Table 4.1), of other gyms: 83.0 % "
        "mIoU without and 88.0 % with refinement by SAM, and 2 h 28 min of painting meshes where "
        "drawing in the photos would have taken 30 h 47 min. Nobody painted or drew here, so there "
        "are no such times; CPU-s are the machine's part, projecting and refining.",
        "",
        "| labels | mIoU | without wall | IoU of objects | CPU-s |",
        "|---|---|---|---|---|",
    ]
    for name, row in figures.items():
        if isinstance(row, dict):
            cells = (row["miou"], row["miou_objects"], row["instance_iou"])
            seconds = row.get("cpu_seconds")
            text = " | ".join(_three(v) for v in cells)
            lines.append(f"| {name} | {text} | {'-' if seconds is None else f'{seconds:.1f}'} |")
    return [*lines, ""]


def _detectors(figures: Mapping[str, Any], setup: Mapping[str, Any]) -> list[str]:
    least = ", ".join(f"{name} {value:.2f}" for name, value in figures["thresholds"].items())
    lines = [
        "COCO's figures, the boxes being those around the masks. AP50, AP and AR rank every "
        "detection down to a score of 0.03, as such figures are published; the last two columns "
        f"are of what a scan uses, detections of the network's own least scores ({least}). "
        "Classes: `mean` is the mean of hold and volume, as publications report it; `all` has them "
        "merged into one. Published (Table 4.3) for other photos of the gym of `hold-masks`, mean "
        "of classes, by networks trained on that very gym: masks AP50 .454, .513 with masks drawn "
        "by SAM; ours never saw it.",
        "",
        "| set | | AP50 | AP | AR | used: AP50 | used: recall over 40 px |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, both in figures["sets"].items():
        for run in ("boxes", "masks"):
            ranked = both["ranked"][run]
            for kind, row in sorted(ranked.items(), key=lambda item: item[0] != "mean"):
                used = both["sure"][run].get(kind, {})
                recall = used.get("recall50", {}).get("over 40 px")
                cells = (row["ap50"], row["ap"], row["ar"], used.get("ap50"), recall)
                lines.append(f"| {name} | {run}, {kind} | " + " | ".join(map(_three, cells)) + " |")
    return [*lines, ""]


def _lift(figures: Mapping[str, Any], setup: Mapping[str, Any]) -> list[str]:
    lines = [
        f"Generated gyms (`walltopo synth`), {setup['photos']} photos of 1280 x 960 each: per "
        f"preset one to tune on, one to choose by, {setup['gyms']} that nothing was chosen on, "
        "which the table shows. Masks by the shipped detector (none of these gyms was in its "
        "training) on the rendered photos, true cameras, and the generator's own mesh: its edges "
        "follow the holds' outlines, which a reconstruction's do not (table 6 has that error "
        "too). AP, AP50, AP25 by the ScanNet protocol on face area: first the mean of the classes, "
        "as publications report it, then all instances as one class; mIoU of "
        "wall, hold and volume, of all instances and of those that a scan shows "
        "(`classify.min_score`).",
        "",
        *_ap_table(figures["tables"]),
        "",
        f"Tuned: {setup['trials']} trials of Bayesian optimisation on the train gym by AP, "
        "mean of classes, the defaults among them; of the defaults and the five best trials the "
        "one with the highest AP on the validation gym was taken.",
        "",
        "| search | trials | train: defaults | chosen | val: defaults | chosen | chosen settings |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, row in figures["tuned"].items():
        values = ", ".join(f"{key} {value:.3g}" for key, value in row["values"].items())
        cells = " | ".join(_three(v) for v in (*row["train"], *row["val"]))
        lines.append(f"| {name} | {row['trials']} | {cells} | {values} |")
    lines += ["", "AP50, mean of classes, of each test gym:", ""]
    for name, rows in figures["tables"].items():
        gyms = list(next(iter(rows.values()))["by_wall"])
        lines += [f"| {name} | " + " | ".join(gyms) + " |", "|---" * (len(gyms) + 1) + "|"]
        for method, row in rows.items():
            cells = " | ".join(_three(row["by_wall"][gym]) for gym in gyms)
            lines.append(f"| {method} | {cells} |")
        lines.append("")
    missing = [name for name in PRESETS if name not in figures["tables"]]
    if missing:
        lines += [f"Not run yet: {', '.join(missing)}.", ""]
    lines += ["Quoted from the publication (its own gyms, its own masks), in per cent:", ""]
    lines += ["| gym | system | mAP50 | mAP | semantic mIoU |", "|---|---|---|---|---|"]
    for gym, quoted in QUOTED.items():
        lines += [f"| {gym} | {n} | {a} | {b} | {c} |" for n, a, b, c in quoted]
    return [
        *lines,
        "",
        "Gyms, masks and trials that were kept from before are not in the time:",
        "",
    ]


def _given(figures: Mapping[str, Any], setup: Mapping[str, Any]) -> list[str]:
    return [
        "True cameras, the fused mesh of `gym-a/lift`. `noisy`: masks missing, fused, false, of "
        "the wrong class, borders off. No setting was chosen on this wall.",
        "",
        *_ap_table(figures),
        "",
    ]


def _ap_table(figures: Mapping[str, Any]) -> list[str]:
    lines = [
        "| input | method | mean of classes: AP50 | AP | one class: AP50 | AP | AP25 "
        "| AP .50:.95 (COCO) | mIoU | mIoU shown | precision shown | recall shown | CPU-s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, rows in figures.items():
        for method, row in rows.items():
            one, mean, shown = row["agnostic"], row["mean"], row.get("shown", {})
            cells = [mean["ap50"], mean["ap"], one["ap50"], one["ap"], one["ap25"], one["coco_ap"]]
            cells += [row["semantics"]["miou"], row.get("semantics_shown", {}).get("miou")]
            cells += [shown.get("precision"), shown.get("recall")]
            text = " | ".join(_three(v) for v in cells)
            lines.append(f"| {name} | {method} | {text} | {row['cpu_seconds']:.1f} |")
    return lines


def _routes(figures: Mapping[str, Any], setup: Mapping[str, Any]) -> list[str]:
    values = ", ".join(f"{name} {value:.3g}" for name, value in figures["values"].items())
    default, tuned = figures["train"]
    lines = [
        "By the names of colours (`routes.link=colour`, the published way), which are true here. "
        f"Tuned: {figures['trials']} trials of Bayesian optimisation on four generated gyms that are "
        f"not in the table (ARI {default:.3f} by default, {tuned:.3f} by the best: {values}; of "
        "equals the earliest, and the defaults are the first trial). Published (Table 4.5): 0.978 "
        "and 0.883 by default, 0.978 and 0.982 tuned, on other gyms.",
        "",
        "| wall | ARI, default | tuned |",
        "|---|---|---|",
    ]
    for name, value in figures["default"].items():
        lines.append(f"| {name} | {_three(value)} | {_three(figures['tuned'][name])} |")
    return [*lines, ""]


def _end_to_end(result: Mapping[str, Any], setup: Mapping[str, Any]) -> list[str]:
    figures = result["figures"]
    values = {
        "instance mAP50": figures.get("instances", {}).get("mean", {}).get("ap50"),
        "instance mAP": figures.get("instances", {}).get("mean", {}).get("ap"),
        "semantic mIoU": figures.get("semantics", {}).get("miou"),
        "route ARI": figures.get("routes", {}).get("ari"),
    }
    lines = ["Shipped models, default settings; only heading and place were fitted to truth.", ""]
    lines += ["| figure | target | reached |", "|---|---|---|"]
    lines += [f"| {k} | {TARGETS[k]:.2f} | {_three(v)} |" for k, v in values.items()]
    lines += ["", *_ranked_and_shown(figures), ""]
    return [*lines, "How long a scan takes: [dense.md](dense.md#measured).", ""]


def _ranked_and_shown(figures: Mapping[str, Any]) -> list[str]:
    """Return the lines on the ranked instances and on those that a user sees."""
    agnostic, shown = figures.get("instances", {}).get("agnostic", {}), figures.get("shown", {})
    precision, recall = _three(shown.get("precision")), _three(shown.get("recall"))
    iou = figures.get("semantics", {}).get("iou", {})
    return [
        "The APs rank every instance that the lift found, doubtful ones too. As one class: AP50 "
        f"{_three(agnostic.get('ap50'))}, AP {_three(agnostic.get('ap'))}.",
        "",
        f"The semantic figure is of what the scan shows: {shown.get('shown', '-')} instances, of "
        f"which {shown.get('hits', '-')} meet one of the {shown.get('truth', '-')} true ones at "
        f"IoU .5 (precision {precision}, recall {recall}); "
        f"IoU of wall {_three(iou.get('0'))}, hold {_three(iou.get('1'))}, volume "
        f"{_three(iou.get('2'))}. Of all instances the mIoU is "
        f"{_three(figures.get('semantics_all', {}).get('miou'))}.",
    ]
