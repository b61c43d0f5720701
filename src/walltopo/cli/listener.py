"""Show a running scan in the terminal: one bar, then one line per stage."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from walltopo.scans.manifest import StageRecord


class TerminalListener:
    """Draws a stage's progress with rich; use as a context manager.

    Parameters
    ----------
    console : where to draw.
    verbose : also show details.
    quiet : show nothing (the caller prints errors).
    bar : started and stopped with the listener; default: one row per step.
    """

    def __init__(
        self,
        console: Console,
        *,
        verbose: bool = False,
        quiet: bool = False,
        bar: Progress | None = None,
    ) -> None:
        self._console = console
        self._verbose, self._quiet = verbose, quiet
        self._stage = ""
        self._task: TaskID | None = None
        self._bar = bar or Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(bar_width=28),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=quiet or not console.is_terminal,
        )

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def step(self, what: str, total: int | None = None) -> None:
        if self._task is not None:
            self._bar.remove_task(self._task)
        label = f"{self._stage:<9} {what}"
        self._task = self._bar.add_task(label, total=total)

    def advance(self, count: int = 1) -> None:
        if self._task is not None:
            self._bar.advance(self._task, count)

    def note(self, message: str) -> None:
        if not self._quiet:
            self._console.print(f"          {message}", style="yellow")

    def detail(self, message: str) -> None:
        if self._verbose and not self._quiet:
            self._console.print(f"          {message}", style="dim")

    def stage_begins(self, stage: str) -> None:
        self._stage = stage
        self.step("starting")

    def stage_ends(self, stage: str, record: StageRecord) -> None:
        if self._task is not None:
            self._bar.remove_task(self._task)
            self._task = None
        if self._quiet:
            return
        mark = ("✓", "green") if record.state == "done" else ("✗", "red")
        facts = describe_metrics(record.metrics) if record.state == "done" else record.state
        self._line(mark, stage, facts, duration(record.seconds))

    def stage_kept(self, stage: str, record: StageRecord) -> None:
        if not self._quiet:
            self._line(("·", "dim"), stage, describe_metrics(record.metrics), "up to date")

    def _line(self, mark: tuple[str, str], stage: str, facts: str, time: str) -> None:
        line = Text.assemble(mark, f" {stage:<9} {facts}  ", (time, "dim"))
        self._console.print(line, soft_wrap=True)


def describe_metrics(metrics: dict[str, Any], width: int | None = None) -> str:
    """Return the one-line summary of a stage: its `summary`, else its scalar figures.

    Parameters
    ----------
    width : maximum number of columns; figures that do not fit are omitted, except the first.
    """
    if isinstance(metrics.get("summary"), str):
        return str(metrics["summary"])
    parts = [f"{key.replace('_', ' ')} {_figure(value)}" for key, value in metrics.items()]
    plain = [part for part, value in zip(parts, metrics.values(), strict=True) if _is_plain(value)]
    while width is not None and len(plain) > 1 and len(", ".join(plain)) > width:
        plain.pop()
    return ", ".join(plain)


def duration(seconds: float) -> str:
    """Return a duration such as 1.4 s or 2 min 05 s."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    return f"{int(seconds // 60)} min {int(seconds % 60):02d} s"


def _is_plain(value: object) -> bool:
    return isinstance(value, (int, float, str, bool))


def _figure(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:,.4g}"
    return str(value)
