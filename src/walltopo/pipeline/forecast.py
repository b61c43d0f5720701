"""How long a scan will take: an estimate, from its photos and from what stages took before.

A stage that this scan has run before takes what it took then. One that it has not takes what was
measured of another wall, times how fast this machine has been so far. It is an estimate: the
number of photos says little of how large the wall is and how many holds it has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from walltopo.scans.manifest import StageRecord


@dataclass(frozen=True)
class Cost:
    """Seconds of a stage: some for any scan, some for each photo and each pair of photos."""

    fixed: float
    per_photo: float
    per_pair: float = 0.0

    def of(self, photos: int) -> float:
        """Seconds for so many photos."""
        pairs = photos * (photos - 1) / 2
        return self.fixed + self.per_photo * photos + self.per_pair * pairs


# Lines through two scans on two cores without a GPU: the demo (20 photos) and `gym-a` (72 photos),
# by `scan.json` of each (docs/scan-folder.md); the lift, which follows no line, by their mean.
COSTS: Mapping[str, Cost] = {
    "ingest": Cost(0.2, 0.022),
    "sparse": Cost(0.0, 0.324, 0.038),
    "scale": Cost(0.8, 0.025),
    "dense": Cost(24, 1.65),
    "texture": Cost(19, 0.36),
    "detect": Cost(2, 0.46),
    "lift": Cost(18, 0.0),
    "classify": Cost(0.6, 0.98),
    "routes": Cost(0.2, 0.126),
    "edit": Cost(0.4, 0.01),
    "export": Cost(14, 0.9),
}
_UNMEASURED = Cost(1, 0)  # a stage that is not in the table yet
_DOUBT = 20.0  # seconds of the table that are taken as kept: short stages tell little of a machine


def photos_of(records: Mapping[str, StageRecord]) -> int | None:
    """How many photos were ingested; None before."""
    record = records.get("ingest")
    count = record.metrics.get("photos") if record and record.state == "done" else None
    return count if isinstance(count, int) and count > 0 else None


@dataclass
class Forecast:
    """The stages that a run will probably compute, and how far it is.

    Parameters
    ----------
    stages : names of those stages, in order.
    photos : how many there are; None while nobody knows (a video before it is read).
    before : the records of the scan as they were when this run began.
    """

    stages: Sequence[str]
    photos: int | None
    before: Mapping[str, StageRecord]
    _ended: dict[str, float] = field(default_factory=dict)

    def ends(self, stage: str, seconds: float) -> None:
        """A stage is done, or was found to be up to date (0 seconds)."""
        self._ended[stage] = seconds

    def photos_are(self, count: int | None) -> None:
        """Ingest has counted."""
        self.photos = count or self.photos

    @property
    def known(self) -> bool:
        """Whether anything can be said at all."""
        return self.photos is not None

    def seconds(self, stage: str) -> float:
        """What a stage will take."""
        then, record = photos_of(self.before), self.before.get(stage)
        typical = _typical(stage, self.photos or 0)
        if record is not None and record.state == "done" and record.seconds > 0 and then:
            return record.seconds * typical / _typical(stage, then)
        return typical * self._pace()

    def left(self, stage: str, elapsed: float) -> float:
        """Seconds until the end, `elapsed` seconds into a stage."""
        rest = [name for name in self.stages if name not in self._ended and name != stage]
        now = self.seconds(stage) - elapsed if stage in self.stages else 0.0
        return max(now, 0.0) + sum(map(self.seconds, rest))

    def share(self, stage: str, elapsed: float) -> float:
        """How much of the whole is done, 0 to 1; 1 early where the last stage takes too long."""
        if stage not in self.stages or stage in self._ended:
            elapsed = 0.0
        done = sum(self._ended.values()) + elapsed
        return done / max(done + self.left(stage, elapsed), 1e-9)

    def _pace(self) -> float:
        """How much slower than in the table the stages were: in this run, else in the last."""
        ran = {name: seconds for name, seconds in self._ended.items() if seconds > 0}
        if ran and self.photos:
            return _ratio(ran, self.photos)
        then = photos_of(self.before)
        kept = {n: r.seconds for n, r in self.before.items() if r.state == "done" and r.seconds > 0}
        if kept and then:
            return _ratio(kept, then)
        return 1.0


def _typical(stage: str, photos: int) -> float:
    return COSTS.get(stage, _UNMEASURED).of(photos)


def _ratio(took: Mapping[str, float], photos: int) -> float:
    """How much slower these stages were than the table says."""
    expected = sum(_typical(name, photos) for name in took)
    return (sum(took.values()) + _DOUBT) / (expected + _DOUBT)
