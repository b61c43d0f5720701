"""Hidden places follow from the log, whatever the scan."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from small_wall import after  # type: ignore[import-not-found]

from walltopo.editing.hiding import hidden_after
from walltopo.scans.edits import Edit, Hide, Place, Unhide

coordinate = st.floats(-2, 2).map(lambda value: round(value, 2))
place = st.tuples(coordinate, coordinate, coordinate)
hides = st.builds(Hide, at=place, radius_m=st.sampled_from([0.05, 0.3, 1.0]))
logs = st.lists(hides | st.builds(Unhide, at=place), max_size=12)


def _at(x: float) -> Place:
    return (x, 0.0, 1.0)


def test_a_place_is_hidden_and_shown_again_as_a_whole_stroke() -> None:
    stroke: list[Edit] = [Hide(at=_at(0.1 * k), radius_m=0.15) for k in range(8)]
    apart = Hide(at=_at(3.0), radius_m=0.15)
    outcome = after([*stroke, apart])
    assert [hidden.at for hidden in outcome.hidden] == [*(_at(0.1 * k) for k in range(8)), _at(3.0)]
    shown = after([*stroke, apart, Unhide(at=_at(0.7))])
    assert [hidden.at for hidden in shown.hidden] == [_at(3.0)]
    assert not shown.notes


def test_nothing_is_shown_again_where_nothing_is_hidden() -> None:
    outcome = after([Hide(at=_at(0.0), radius_m=0.2), Unhide(at=_at(0.5))])
    assert len(outcome.hidden) == 1
    (note,) = outcome.notes
    assert note.text == "edit 2 (unhide) was skipped: nothing is hidden at this place"


@given(log=logs)
def test_a_replay_and_the_log_alone_agree(log: list[Edit]) -> None:
    assert after(log).hidden == hidden_after(log)
