"""The estimate of a scan's time: from the table, from this machine's pace, from its last run."""

from __future__ import annotations

import pytest

from walltopo.pipeline.forecast import Forecast, photos_of
from walltopo.pipeline.stages import STAGES
from walltopo.scans.manifest import StageRecord

COSTS = {stage.name: stage.cost for stage in STAGES}
ALL = list(COSTS)


def _records(photos: int, pace: float = 1.0) -> dict[str, StageRecord]:
    records = {
        name: StageRecord("done", seconds=pace * cost.of(photos)) for name, cost in COSTS.items()
    }
    records["ingest"].metrics = {"photos": photos}
    return records


@pytest.mark.parametrize("photos", [1, 20, 72, 500])
def test_more_photos_take_longer(photos: int) -> None:
    assert (
        0
        < Forecast(ALL, photos, {}).seconds_left("", 0)
        < Forecast(ALL, photos + 1, {}).seconds_left("", 0)
    )


def test_a_slow_machine_is_noticed() -> None:
    forecast = Forecast(ALL, 72, {})
    by_table = forecast.seconds_left("scale", 0)
    forecast.stage_ended("ingest", 3 * COSTS["ingest"].of(72))
    forecast.stage_ended("sparse", 3 * COSTS["sparse"].of(72))
    rest = sum(COSTS[name].of(72) for name in ALL[2:])
    assert 2.3 * rest < forecast.seconds_left("scale", 0) < 3 * rest < 3 * by_table


def test_a_stage_that_ran_before_takes_what_it_took() -> None:
    forecast = Forecast(["lift", "export"], 20, _records(20, pace=2.0))
    assert forecast.seconds_left("", 0) == pytest.approx(
        2 * (COSTS["lift"].of(20) + COSTS["export"].of(20))
    )
    more = Forecast(["export"], 40, _records(20, pace=2.0))
    assert more.seconds_left("", 0) == pytest.approx(2 * COSTS["export"].of(40))


def test_a_resumed_scan_counts_only_what_is_left() -> None:
    before = {name: record for name, record in _records(20).items() if name in ALL[:4]}
    resumed = Forecast(ALL[4:], photos_of(before), before)
    whole = Forecast(ALL, 20, {})
    assert 0 < resumed.seconds_left("", 0) < whole.seconds_left("", 0)


def test_time_runs_and_what_is_done_grows() -> None:
    forecast = Forecast(ALL, 20, {})
    shares, lefts = [], []
    for name in ALL:
        took = 1.5 * COSTS[name].of(20)
        for elapsed in (0.0, took / 2, took, 5 * took):  # the last: much longer than expected
            shares.append(forecast.share_done(name, elapsed))
            lefts.append(forecast.seconds_left(name, elapsed))
        forecast.stage_ended(name, took)
    assert min(shares) == 0
    assert all(0 <= share <= 1 for share in shares)
    assert max(shares[:-4]) < 1, "not at its end before its last stage"
    assert min(lefts) >= 0
    assert forecast.seconds_left("", 0) == 0
    assert forecast.share_done("", 0) == 1


def test_a_stage_that_was_up_to_date_after_all() -> None:
    forecast = Forecast(["lift", "classify", "export"], 20, {})
    before = forecast.seconds_left("", 0)
    forecast.stage_ended("classify", 0.0)
    assert forecast.seconds_left("", 0) == pytest.approx(before - COSTS["classify"].of(20))


def test_before_a_video_is_read_nothing_is_known() -> None:
    forecast = Forecast(ALL, photos_of({}), {})
    assert not forecast.is_known
    forecast.set_photo_count(photos_of({"ingest": StageRecord("done", metrics={"photos": 33})}))
    assert forecast.is_known
    assert forecast.photos == 33
