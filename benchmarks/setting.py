"""Agreement of proposed problems with their specification, by a grade model outside the search.

    python -m benchmarks.setting DATA CACHE

The walls are generated, and all their holds count, regardless of colour. The board's problems are
split into two halves (near-duplicates on one side), and a grade model is trained on each. The
search uses one model, the other evaluates the proposals. Both use the same movement model and
features, so their agreement shows only that the search does not exploit one fit. It does not show
that climbers would agree. DATA and CACHE: see `benchmarks.grades`.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from msgspec import structs

from walltopo.scans.routes import Route
from walltopo_climb.grades.font import FONT, parse_grade
from walltopo_climb.grades.model import GradeModel, Range
from walltopo_climb.grades.of_scan import Scale, climb_route
from walltopo_climb.movement.body import ADULT
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.rows import Proposal
from walltopo_climb.problems.search import propose
from walltopo_climb.problems.spec import ProblemSpec
from walltopo_lab.synth.set_gyms import set_gym
from walltopo_lab.train.grades.cached import training_boards
from walltopo_lab.train.grades.fit import TrainingBoard
from walltopo_lab.train.grades.shipped import fit_on, write_model
from walltopo_lab.train.grades.split import parts_of

WALLS = (("sprawall", 1), ("sprawall", 2), ("modern", 1), ("oldschool-dark", 1))
WISHES = ("6C", "7A", "7B", "7C")
_SEED = 7


def half(board: TrainingBoard, number: int) -> TrainingBoard:
    """Return one half of a board's problems, split by groups; its parts 0 and 1 are unchanged."""
    mine = parts_of(board.groups, (0.5, 0.5), _SEED) == number
    arrays = {
        name: getattr(board, name)[mine]
        for name in ("grade", "stars", "groups", "part", "plain", "known", "seconds")
    }
    problems = tuple(one for one, taken in zip(board.problems, mine, strict=True) if taken)
    return replace(board, problems=problems, **arrays)


def model_of(found: Sequence[TrainingBoard], number: int, folder: Path) -> GradeModel:
    """Train, write and load the grade model of one half."""
    halves = [half(board, number) for board in found]
    path = folder / f"{number}.onnx"
    write_model(fit_on(halves), halves, path)
    return GradeModel.load(path)


def pool_of(preset: str, seed: int) -> Pool:
    """Return the holds of a generated wall; the wall's steepness is that of each hold's normal."""
    holds = tuple(
        structs.replace(
            hold, steepness_deg=math.degrees(math.asin(max(-1.0, min(1.0, -hold.normal[2]))))
        )
        for hold in set_gym(preset, seed).holds
    )
    return Pool.of(holds, 1.0, True)


@dataclass(frozen=True)
class Row:
    """A judged proposal: requested grade, whether an adult reaches the top, the other model's
    range.
    """

    requested: float
    tops: bool
    difficulty: float
    range: Range
    fits: bool
    alike: float


def judge(pool: Pool, one: Proposal, spec: ProblemSpec, scale: Scale) -> Row:
    """Return the judgement of a proposal by a model that the search did not use."""
    holds = (*one.hands, *one.feet)
    route = Route(0, holds=holds, start=one.start, top=one.top, footholds=one.feet)
    climbed = climb_route(route, pool.near(holds), pool.unit)
    tops = climbed is not None and climbed.moves.reached and climbed.moves.body == ADULT
    requested = parse_grade(spec.grade)
    assert climbed is not None
    assert requested is not None
    difficulty = float(scale.model.difficulties(climbed.features[None])[0])
    found = scale.range(difficulty, climbed.known)
    return Row(requested, tops, difficulty, found, not one.violations, one.alike)


def main(arguments: list[str]) -> int:
    if len(arguments) != 2:
        print(__doc__)
        return 2
    folders = Path(arguments[0]), Path(arguments[1])
    found = list(training_boards(*folders, 1, ("2016",)).values())
    with tempfile.TemporaryDirectory() as name:
        searches, judges = (Scale(model_of(found, k, Path(name)), ()) for k in (0, 1))
    print(
        "| spec | proposed | as requested | top reached | requested in the other's range | "
        "other's place off, grades, median | alike, mean | CPU-s an answer |"
    )
    print("|---|---|---|---|---|---|---|---|")
    everything: list[Row] = []
    seconds: list[float] = []
    for grade in WISHES:
        rows: list[Row] = []
        took: list[float] = []
        for preset, seed in WALLS:
            pool = pool_of(preset, seed)
            spec = ProblemSpec(grade=grade, seed=seed)
            began = time.process_time()
            answer = propose(pool, spec, searches)
            took.append(time.process_time() - began)
            rows += [judge(pool, one, spec, judges) for one in answer.proposals]
        print(_line(grade, rows, took))
        everything += rows
        seconds += took
    print(_line("all", everything, seconds))
    return 0


def _line(name: str, rows: Sequence[Row], seconds: Sequence[float]) -> str:
    inside = [one.range.low <= round(one.requested) <= one.range.high for one in rows]
    off: npt.NDArray[np.float64] = np.array([abs(one.difficulty - one.requested) for one in rows])
    wanted_count = 3 * len(seconds)
    return (
        f"| {name} | {len(rows)} of {wanted_count} | {np.mean([one.fits for one in rows]):.2f} | "
        f"{np.mean([one.tops for one in rows]):.2f} | {np.mean(inside):.2f} | "
        f"{np.median(off):.2f} | {np.mean([one.alike for one in rows]):.2f} | "
        f"{np.median(seconds):.1f} |"
    )


assert all(grade in FONT for grade in WISHES)

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
