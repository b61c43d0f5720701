"""Outputs of a search: walltopo.toml, a report, and plots of the metric over each setting."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from walltopo.core.files import atomic_path, read_toml
from walltopo_lab.plots import make_panels, save_figure
from walltopo_lab.tune.study import Found
from walltopo_lab.tune.task import Task


def _toml_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml_value(item) for item in value) + "]"
    text = str(value).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{text}"'


def merge_settings(path: Path, section: str, values: Mapping[str, Any]) -> None:
    """Merge values into a section of walltopo.toml; keeps other sections and keys, drops comments.

    Raises
    ------
    InputError : the file exists and is not TOML.
    """
    data: dict[str, dict[str, Any]] = {}
    if path.is_file():
        data = read_toml(path)
    data.setdefault(section, {}).update(values)
    lines: list[str] = []
    for name, content in data.items():
        lines.append(f"[{name}]")
        lines += [f"{key} = {_toml_value(value)}" for key, value in content.items()]
        lines.append("")
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines), encoding="utf-8")


def write_slices(path: Path, task: Task, found: Found) -> None:
    """Plot the metric of every trial over each setting, one panel per setting."""
    real = [t for t in found.trials if t.walls]
    figure, axes = make_panels(len(task.ranges))
    for panel, r in zip(axes, task.ranges, strict=True):
        share = found.importance.get(r.name)
        title = r.name if share is None else f"{r.name} (importance {share:.2f})"
        panel.set(title=title, xlabel=r.name, ylabel=task.figure, xlim=(r.low, r.high))
        for name, trials in (
            ("trial", real),
            ("default", [found.default]),
            ("best", [found.best]),
        ):
            values = [t.values[r.name] for t in trials]
            panel.plot(values, [t.figure for t in trials], "o", label=name)
        panel.legend()
    save_figure(figure, path)


def write_report(
    path: Path,
    task: Task,
    found: Found,
    test: Mapping[str, tuple[float, float]] | None,
) -> None:
    """Write the report of a search in Markdown.

    Parameters
    ----------
    test : name of a test wall to the metric with (defaults, best settings). None: without test
        walls;
    the report then states that its metrics are those of the tuning walls.
    """
    lines = [f"# Tuning of `{task.section}`", ""]
    lines += [f"{len(found.trials)} trials; the figure is {task.figure}, mean over walls.", ""]
    if test is None:
        lines += [
            "**No test walls were given. The figures below are on the very walls that were tuned "
            "on; they say nothing about other walls.**",
            "",
        ]
    else:
        lines += [
            "## On walls that were not tuned on",
            "",
            "| wall | defaults | tuned |",
            "|---|---|---|",
        ]
        lines += [f"| {name} | {a:.3f} | {b:.3f} |" for name, (a, b) in test.items()]
        mean = [sum(pair[k] for pair in test.values()) / len(test) for k in (0, 1)]
        lines += [f"| mean | {mean[0]:.3f} | {mean[1]:.3f} |", ""]
    lines += ["## On the walls it was tuned on", "", "| wall | defaults | tuned |", "|---|---|---|"]
    for name, value in found.best.walls.items():
        lines.append(f"| {name} | {found.default.walls[name]:.3f} | {value:.3f} |")
    lines += [f"| mean | {found.default.figure:.3f} | {found.best.figure:.3f} |", ""]
    lines += [
        "## Settings",
        "",
        "| setting | range | default | tuned | importance |",
        "|---|---|---|---|---|",
    ]
    for r in task.ranges:
        share = found.importance.get(r.name)
        lines.append(
            f"| {r.name} | {r.low:g} to {r.high:g} | {found.default.values[r.name]:g} | "
            f"{found.best.values[r.name]:.4g} | {'-' if share is None else f'{share:.2f}'} |"
        )
    lines += ["", "Importance: fANOVA, the share of the figure's variance a setting explains.", ""]
    lines += ["![slices](slices.png)", ""]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines), encoding="utf-8")
