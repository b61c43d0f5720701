"""What a detector's search leaves: tuned.toml, a report, a plot of the search."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from walltopo.core import InputError
from walltopo.core.files import atomic_path
from walltopo_lab.plotting import Axis, Chart, write_charts
from walltopo_lab.tune.detector import DetectorSearch, SearchTrial, model_name

__all__ = ["best_trial", "write_search"]


def best_trial(trials: Sequence[SearchTrial]) -> SearchTrial:
    """The trial with the highest AP50 of those that were not stopped; the earliest of equals.

    Raises
    ------
    InputError : no trial was trained to its end.
    """
    whole = [t for t in trials if not t.stopped]
    if not whole:
        raise InputError("no trial was trained to its end", "Give more --trials.")
    return max(whole, key=lambda t: (t.best, -t.number))


def write_search(folder: Path, search: DetectorSearch, trials: Sequence[SearchTrial]) -> None:
    """Write `tuned.toml` (for `walltopo train --hyp`), `report.md` and `search.png`."""
    best = best_trial(trials)
    _write(folder / "tuned.toml", _settings(search, best))
    _write(folder / "report.md", _report(search, trials, best))
    write_charts(folder / "search.png", _charts(search, trials, best))


def _write(path: Path, lines: Sequence[str]) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _settings(search: DetectorSearch, best: SearchTrial) -> list[str]:
    """Keys of the settings class that the family trains with."""
    values, votes = best.values, search.family == "votes"
    model = "votes" if votes else model_name(search.family, values["network"])
    lines = [
        f"# walltopo train ... --model {model} --hyp tuned.toml",
        f"rate = {values['rate']:.6g}",
        f"momentum = {values['momentum']:.4g}",
        f"batch = {values['batch']}",
        f"{'crop' if votes else 'size'} = {values['size']}",
    ]
    return [*lines, f'network = "{values["network"]}"'] if votes else lines


def _report(search: DetectorSearch, trials: Sequence[SearchTrial], best: SearchTrial) -> list[str]:
    stopped = sum(t.stopped for t in trials)
    lines = [
        f"# Tuning of {search.family}",
        "",
        f"{len(trials)} trials of {search.minutes:g} minutes, {stopped} of them stopped early by "
        f"successive halving. The fitness is AP50 on held-out photos of the training sets: it "
        f"chose, and flatters.",
        "",
        f"Best: trial {best.number}, AP50 {best.best:.3f}; its settings are in `tuned.toml`.",
        "",
        "| trial | AP50 | rate | momentum | batch | size | network | ended |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for t in sorted(trials, key=lambda t: (-t.best, t.number)):
        v, last = t.values, max(t.steps, default=0)
        lines.append(
            f"| {t.number} | {t.best:.3f} | {v['rate']:.2g} | {v['momentum']:.3f} | {v['batch']} | "
            f"{v['size']} | {v['network']} | {'stopped at' if t.stopped else 'step'} {last} |"
        )
    return [*lines, "", "![the search](search.png)"]


def _charts(
    search: DetectorSearch, trials: Sequence[SearchTrial], best: SearchTrial
) -> list[Chart]:
    """AP50 over the steps of every trial, and over each setting."""
    import math

    space = search.space()
    top = Axis("AP50", 0.0, max(1e-3, 1.1 * best.best))
    steps = max(max(t.steps, default=1) for t in trials)
    course = Chart("trials", Axis("check or epoch", 0.0, float(steps)), top)
    for t in trials:
        course.line(list(t.steps), list(t.steps.values()), "", 1 if t.stopped else 0)
        course.points([max(t.steps, default=0)], [t.best], "", 1 if t.stopped else 0)
    course.line(list(best.steps), list(best.steps.values()), f"trial {best.number} (best)", 2)
    charts = [course]
    for name in ("rate", "momentum", "batch", "size", "network"):
        allowed = space[name]
        if name == "rate":
            places = [math.log10(t.values[name]) for t in trials]
            axis = Axis("log10 rate", math.log10(allowed[0]), math.log10(allowed[1]))
        elif name == "momentum":
            places = [float(t.values[name]) for t in trials]
            axis = Axis(name, *allowed)
        else:
            places = [float(allowed.index(t.values[name])) for t in trials]
            axis = Axis(", ".join(map(str, allowed)), -0.5, len(allowed) - 0.5)
        chart = Chart(name, axis, top)
        for stopped, word in ((False, "to the end"), (True, "stopped early")):
            chosen = [k for k, t in enumerate(trials) if t.stopped == stopped]
            series = 1 if stopped else 0
            chart.points(
                [places[k] for k in chosen], [trials[k].best for k in chosen], word, series
            )
        charts.append(chart)
    return charts
