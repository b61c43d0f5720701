"""Show one bar for a whole scan: the current stage, the progress and the time left."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskProgressColumn, TextColumn

from walltopo.cli.listener import TerminalListener
from walltopo.pipeline.forecast import Forecast, photos_of
from walltopo.scans.manifest import StageRecord

MAX_WIDTH = 34  # columns of the current step, so that the bar fits into 80


class ScanListener(TerminalListener):
    """Draws a scan as one bar with the time left, and a line per stage above it.

    Parameters
    ----------
    clock : returns seconds from an arbitrary start.
    """

    def __init__(
        self,
        console: Console,
        *,
        verbose: bool = False,
        quiet: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        bar = _Bar(self._status, console, disable=quiet or not console.is_terminal)
        super().__init__(console, verbose=verbose, quiet=quiet, bar=bar)
        self._clock = clock
        self._forecast: Forecast | None = None
        self._began = clock()
        self._what, self._done = "", 0
        self._total: int | None = None

    def scan_begins(self, forecast: Forecast) -> None:
        self._forecast = forecast
        self._print_estimate()

    def step(self, what: str, total: int | None = None) -> None:
        self._what, self._total, self._done = what, total, 0

    def advance(self, count: int = 1) -> None:
        self._done += count

    def stage_begins(self, stage: str) -> None:
        self._began = self._clock()
        super().stage_begins(stage)

    def stage_ends(self, stage: str, record: StageRecord) -> None:
        super().stage_ends(stage, record)
        if self._forecast is None:
            return
        self._forecast.stage_ended(stage, record.seconds)
        if not self._forecast.is_known:
            self._forecast.set_photo_count(photos_of({stage: record}))
            self._print_estimate()

    def stage_kept(self, stage: str, record: StageRecord) -> None:
        super().stage_kept(stage, record)
        if self._forecast is not None:
            self._forecast.stage_ended(stage, 0.0)

    def _print_estimate(self) -> None:
        """Print the estimated time once, so that a log has it too."""
        forecast = self._forecast
        if self._quiet or forecast is None or not forecast.is_known or not forecast.stages:
            return
        left = rough_duration(forecast.seconds_left("", 0.0))
        photos = f"{forecast.photos} photo{'' if forecast.photos == 1 else 's'}"
        self._console.print(f"  {photos}: {left} (estimate)", style="dim")

    def _status(self) -> tuple[float, str, str]:
        """Return the share done, the current step and the time left, at this moment."""
        count = "" if self._total is None else f" {self._done}/{self._total}"
        what = f"{self._stage:<8} {self._what}"
        room = MAX_WIDTH - len(count)
        what = (what if len(what) <= room else what[: room - 1] + "…") + count
        forecast = self._forecast
        if forecast is None or not forecast.is_known:
            return 0.0, what, ""
        elapsed = self._clock() - self._began
        left = rough_duration(forecast.seconds_left(self._stage, elapsed))
        return forecast.share_done(self._stage, elapsed), what, f"{left} left"


class _Bar(Progress):
    """A bar that queries its state whenever it is drawn."""

    def __init__(
        self, status: Callable[[], tuple[float, str, str]], console: Console, *, disable: bool
    ) -> None:
        self._status = status
        self._row = None
        columns = (
            SpinnerColumn(),
            BarColumn(bar_width=16),
            TaskProgressColumn(),
            TextColumn("{task.description}"),
            TextColumn("{task.fields[left]}"),
        )
        super().__init__(*columns, console=console, transient=True, disable=disable)
        self._row = self.add_task("", total=1.0, left="")

    def get_renderables(self) -> Iterable[RenderableType]:
        task = self._tasks.get(self._row) if self._row is not None else None
        if task is not None:
            task.completed, task.description, task.fields["left"] = self._status()
        return super().get_renderables()


def rough_duration(seconds: float) -> str:
    """Return a rounded duration in words, such as "under a minute" or "about 1 h 20 min"."""
    if seconds < 50:
        return "under a minute"
    minutes = max(1, round(seconds / 60))
    if minutes >= 10:
        minutes = 5 * round(minutes / 5)
    if minutes < 60:
        return f"about {minutes} min"
    return (
        f"about {minutes // 60} h {minutes % 60:02d} min"
        if minutes % 60
        else f"about {minutes // 60} h"
    )
