"""Estimate how long a scan will take, from its photos and earlier stage times.

For a stage that this scan has run before, the estimate is the earlier time. For other stages it is
the time measured on another wall, scaled by this machine's speed so far. The estimate is rough,
because the number of photos says little about the size of the wall and its number of holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from walltopo.pipeline.stages import stage_named
from walltopo.scans.manifest import StageRecord

# Seconds added to the actual and the typical time; damps the ratio of short stages.
_DAMPING_S = 20.0


def photos_of(records: Mapping[str, StageRecord]) -> int | None:
    """Return the number of ingested photos, or None if ingest is not done."""
    record = records.get("ingest")
    count = record.metrics.get("photos") if record and record.state == "done" else None
    return count if isinstance(count, int) and count > 0 else None


@dataclass
class Forecast:
    """The stages that a run will probably compute, and their progress.

    Parameters
    ----------
    stages : names of the stages, in order.
    photos : number of photos; None if unknown (a video before it is read).
    before : stage records of the scan at the start of this run.
    """

    stages: Sequence[str]
    photos: int | None
    before: Mapping[str, StageRecord]
    _ended: dict[str, float] = field(default_factory=dict)

    def stage_ended(self, stage: str, seconds: float) -> None:
        """Record that a stage is done, or up to date (0 seconds)."""
        self._ended[stage] = seconds

    def set_photo_count(self, count: int | None) -> None:
        """Set the number of photos once ingest has counted them."""
        self.photos = count or self.photos

    @property
    def is_known(self) -> bool:
        """Return whether an estimate is possible."""
        return self.photos is not None

    def seconds(self, stage: str) -> float:
        """Return the estimated duration of a stage."""
        then, record = photos_of(self.before), self.before.get(stage)
        typical = _typical_seconds(stage, self.photos or 0)
        if record is not None and record.state == "done" and record.seconds > 0 and then:
            return record.seconds * typical / _typical_seconds(stage, then)
        return typical * self._pace()

    def seconds_left(self, stage: str, elapsed: float) -> float:
        """Return the estimated seconds until the end, `elapsed` seconds into a stage."""
        rest = [name for name in self.stages if name not in self._ended and name != stage]
        now = self.seconds(stage) - elapsed if stage in self.stages else 0.0
        return max(now, 0.0) + sum(map(self.seconds, rest))

    def share_done(self, stage: str, elapsed: float) -> float:
        """Return the share that is done, 0 to 1; 1 early if the last stage takes too long."""
        if stage not in self.stages or stage in self._ended:
            elapsed = 0.0
        done = sum(self._ended.values()) + elapsed
        return done / max(done + self.seconds_left(stage, elapsed), 1e-9)

    def _pace(self) -> float:
        """Return the ratio of actual to typical times: of this run, else of the last one."""
        ran = {name: seconds for name, seconds in self._ended.items() if seconds > 0}
        if ran and self.photos:
            return _pace_ratio(ran, self.photos)
        then = photos_of(self.before)
        kept = {n: r.seconds for n, r in self.before.items() if r.state == "done" and r.seconds > 0}
        if kept and then:
            return _pace_ratio(kept, then)
        return 1.0


def _typical_seconds(stage: str, photos: int) -> float:
    """Return the typical duration of a stage for a number of photos, seconds."""
    return stage_named(stage).cost.of(photos)


def _pace_ratio(took: Mapping[str, float], photos: int) -> float:
    """Return the damped ratio of actual to typical times of some stages."""
    expected = sum(_typical_seconds(name, photos) for name in took)
    return (sum(took.values()) + _DAMPING_S) / (expected + _DAMPING_S)
