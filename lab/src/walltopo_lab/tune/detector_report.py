"""Outputs of a detector's hyperparameter search: tuned.toml, a report and a plot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from walltopo.core import InputError
from walltopo.core.files import atomic_path
from walltopo_lab.plots import COLOURS, make_panels, save_figure
from walltopo_lab.tune.detector import DetectorSearch, SearchTrial, model_name


def best_trial(trials: Sequence[SearchTrial]) -> SearchTrial:
    """Return the unpruned trial with the highest AP50; the earliest one in case of a tie.

    Raises
    ------
    InputError : every trial was pruned.
    """
    whole = [t for t in trials if not t.stopped]
    if not whole:
        raise InputError("no trial was trained to its end", "Give more --trials.")
    return max(whole, key=lambda t: (t.best, -t.number))


def write_search(folder: Path, search: DetectorSearch, trials: Sequence[SearchTrial]) -> None:
    """Write `tuned.toml` (for `walltopo train --hyp`), `report.md` and `search.png`."""
    best = best_trial(trials)
    _write(folder / "tuned.toml", _settings_lines(search, best))
    _write(folder / "report.md", _report(search, trials, best))
    _draw_plots(folder / "search.png", search, trials, best)


def _write(path: Path, lines: Sequence[str]) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _settings_lines(search: DetectorSearch, best: SearchTrial) -> list[str]:
    """Return the keys of the settings class that the family trains with, as TOML lines."""
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


def _draw_plots(
    path: Path, search: DetectorSearch, trials: Sequence[SearchTrial], best: SearchTrial
) -> None:
    """Plot AP50 over the steps of every trial, and over each hyperparameter."""
    figure, (course, *axes) = make_panels(6)
    for t in trials:
        course.plot(list(t.steps), list(t.steps.values()), color=COLOURS[t.stopped], marker=".")
    course.plot(
        list(best.steps),
        list(best.steps.values()),
        color=COLOURS[2],
        lw=2,
        label=f"trial {best.number} (best)",
    )
    course.set(title="trials", xlabel="check or epoch", ylabel="AP50")
    course.legend()
    for panel, name in zip(axes, ("rate", "momentum", "batch", "size", "network"), strict=True):
        continuous = name in ("rate", "momentum")
        for stopped, word in ((False, "to the end"), (True, "stopped early")):
            chosen = [t for t in trials if t.stopped == stopped]
            allowed = search.space()[name]
            places = [
                t.values[name] if continuous else allowed.index(t.values[name]) for t in chosen
            ]
            panel.plot(places, [t.best for t in chosen], "o", label=word)
        if name == "rate":
            panel.set_xscale("log")
        if not continuous:
            panel.set_xticks(range(len(allowed)), [str(value) for value in allowed])
        panel.set(title=name, ylabel="AP50")
        panel.legend()
    save_figure(figure, path)
