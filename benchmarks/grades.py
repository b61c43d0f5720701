"""Accuracy of the movement model and the grade model on problems of a standard board.

    python -m benchmarks.grades fit DATA CACHE OUT [2016]   the model that ships
    python -m benchmarks.grades report DATA CACHE [2016]   on the part that measures
    python -m benchmarks.grades carried DATA CACHE     from one set-up to the other
    python -m benchmarks.grades both DATA CACHE        learnt from one set-up, the
                                                                    other, both; measured on each
    python -m benchmarks.grades gym DATA CACHE         one set-up as a gym with
                                                                    some known grades
    python -m benchmarks.grades movement DATA CACHE    tops reached, seconds

DATA is the folder of the test data (with `board-grades`). CACHE keeps the movement of all problems,
which takes a quarter of an hour on two cores.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from sklearn.ensemble import HistGradientBoostingRegressor

from walltopo.core.parallel import available_cores
from walltopo_climb.grades.calibrate import Known, calibrate
from walltopo_climb.grades.features import FEATURES
from walltopo_climb.grades.font import FONT, V_OF
from walltopo_climb.grades.model import Errors, range_of
from walltopo_lab.train.grades.board import SETUPS
from walltopo_lab.train.grades.cached import training_boards
from walltopo_lab.train.grades.fit import Floats, TrainingBoard, regressor
from walltopo_lab.train.grades.ordinal import fit_ordered
from walltopo_lab.train.grades.shipped import errors_of, fit_on, write_model

Ints = npt.NDArray[np.int64]
_V = np.array(V_OF)
_GIVEN = (0, 5, 20, 100, 300)
_DRAWS = 20
HEAD = (
    "| set-up | from | exact | ±1 | MAE | V: exact | V: ±1 | in the range | range, grades |",
    "|---|---|---|---|---|---|---|---|---|",
)


def _columns(names: Iterable[str]) -> list[int]:
    return [list(FEATURES).index(name) for name in names]


def _figures(board: TrainingBoard, name: str, table: npt.NDArray[np.float32], what: str) -> str:
    """Return a row: trained on part 0, odds and ranges from part 1, measured on part 2."""
    ok = board.reached
    learnt, calibration, measured = (ok & (board.part == k) for k in range(3))
    model = (
        regressor().set_params(monotonic_cst=None)
        if table.shape[1] < len(FEATURES)
        else regressor()
    )
    model.fit(table[learnt], board.grade[learnt])
    return _row(
        name,
        what,
        (model.predict(table[calibration]), board.grade[calibration]),
        (model.predict(table[measured]), board.grade[measured]),
    )


def _row(
    name: str, what: str, calibration: tuple[Floats, Floats], measured: tuple[Floats, Floats]
) -> str:
    odds = fit_ordered(calibration[0], calibration[1].astype(np.int64))
    errors = errors_of(*calibration)
    difficulty, grade = measured
    true = grade.astype(np.int64)
    return (
        f"| {name} | {what} | "
        + _shares(
            odds.most_likely(difficulty), odds.middle(difficulty), odds.within_one(difficulty), true
        )
        + _ranges(difficulty, true, errors)
    )


def _shares(likely: Ints, middle: Ints, near: Ints, true: Ints) -> str:
    exact = float((likely == true).mean())
    one = float((np.abs(near - true) <= 1).mean())
    mae = float(np.abs(middle - true).mean())
    v_exact = float((_V[likely] == _V[true]).mean())
    v_one = float((np.abs(_V[near] - _V[true]) <= 1).mean())
    return f"{exact:.3f} | {one:.3f} | {mae:.2f} | {v_exact:.3f} | {v_one:.3f} | "


def _ranges(difficulty: Floats, true: Ints, errors: Errors) -> str:
    ends = np.array([range_of(float(p), errors.bound) for p in difficulty])
    inside = (ends[:, 0] <= true) & (true <= ends[:, 1])
    return f"{inside.mean():.3f} | {(ends[:, 1] - ends[:, 0] + 1).mean():.1f} |"


def report(found: dict[str, TrainingBoard]) -> list[str]:
    lines = list(HEAD)
    for name, board in found.items():
        count = np.nan_to_num(board.plain[:, _columns(["holds", "steepness"])])
        lines += [
            _median(board, name),
            _figures(board, name, count, "number of holds and angle"),
            _figures(board, name, np.nan_to_num(board.plain, nan=0.0), "movement, places alone"),
            _figures(board, name, board.known, "movement and quality of holds"),
        ]
        popular = _stars(board, name)
        lines += [popular]
    return lines


def _median(board: TrainingBoard, name: str) -> str:
    learnt, measured = board.part == 0, board.part == 2
    true = board.grade[measured].astype(np.int64)
    given = board.grade[learnt]
    counts = np.bincount(given.astype(np.int64), minlength=len(FONT))
    window = np.convolve(counts, np.ones(3), "same")

    def all_of(grade: int) -> Ints:
        return np.full(len(true), grade)

    middle = float(np.median(given))
    errors = errors_of(np.full(int((board.part == 1).sum()), middle), board.grade[board.part == 1])
    shares = _shares(
        all_of(int(counts.argmax())), all_of(int(middle)), all_of(int(window.argmax())), true
    )
    return f"| {name} | always the same grade | {shares}" + _ranges(
        np.full(len(true), middle), true, errors
    )


def _stars(board: TrainingBoard, name: str) -> str:
    """Return the last row of `report`, measured on problems of three stars."""
    ok = board.reached
    learnt, given = (ok & (board.part == k) for k in range(2))
    measured = ok & (board.part == 2) & (board.stars == 3)
    model = regressor().fit(board.known[learnt], board.grade[learnt])
    return _row(
        name,
        "the same, of three stars",
        (model.predict(board.known[given]), board.grade[given]),
        (model.predict(board.known[measured]), board.grade[measured]),
    )


def _other(found: dict[str, TrainingBoard], name: str) -> HistGradientBoostingRegressor:
    """Return the model trained on the other set-ups."""
    return fit_on([board for other, board in found.items() if other != name])


def carried(found: dict[str, TrainingBoard]) -> list[str]:
    """Return the figures of one set-up's model on the other, with hold positions alone."""
    lines = ["| from | to | what | exact | ±1 | MAE |", "|---|---|---|---|---|---|"]
    for name, board in found.items():
        (other,) = (key for key in found if key != name)
        source = found[other]
        ok = board.reached
        true = board.grade[ok].astype(np.int64)
        rows = {
            "median": np.full(len(true), np.median(source.grade)),
            "number of holds and angle": _counted(source, board),
            "movement": _other(found, name).predict(board.plain[ok]),
        }
        for what, difficulty in rows.items():
            off = np.abs(np.round(difficulty) - true)
            lines.append(
                f"| {other} | {name} | {what} | {(off == 0).mean():.3f} | "
                f"{(off <= 1).mean():.3f} | {off.mean():.2f} |"
            )
    return lines


def _counted(source: TrainingBoard, board: TrainingBoard) -> Floats:
    columns = _columns(["holds", "steepness"])
    model = regressor().set_params(monotonic_cst=None)
    model.fit(source.plain[source.reached][:, columns], source.grade[source.reached])
    return np.asarray(model.predict(board.plain[board.reached][:, columns]))


def both(found: dict[str, TrainingBoard]) -> list[str]:
    """Return the figures of the shipped model trained on one set-up, on the other, and on both.

    Each is measured on data outside its training (part 2). Odds and ranges come from part 1 of the
    training set-ups.
    """
    lines = list(HEAD)
    choices = [[name] for name in found] + [list(found)]
    fitted = [(names, fit_on([found[name] for name in names])) for names in choices]
    for tested, board in found.items():
        measured = board.reached & (board.part == 2)
        for which, words in (("plain", "places alone"), ("known", "quality of holds")):
            for names, model in fitted:
                sources = [
                    (found[name], found[name].reached & (found[name].part == 1)) for name in names
                ]
                difficulty = np.concatenate(
                    [model.predict(getattr(source, which)[held]) for source, held in sources]
                )
                grade = np.concatenate([source.grade[held] for source, held in sources])
                lines.append(
                    _row(
                        tested,
                        f"{' and '.join(names)}, {words}",
                        (difficulty, grade),
                        (model.predict(getattr(board, which)[measured]), board.grade[measured]),
                    )
                )
    return lines


def gym(found: dict[str, TrainingBoard]) -> list[str]:
    """Return the figures of one set-up as a gym: the other's model, and a few own grades."""
    lines = [
        "| gym | grades told | ±1 | MAE | in the range | range, grades |",
        "|---|---|---|---|---|---|",
    ]
    for name, board in found.items():
        model = _other(found, name)
        source = next(other for key, other in found.items() if key != name)
        held = source.reached & (source.part == 1)
        errors = errors_of(model.predict(source.plain[held]), source.grade[held])
        difficulty = model.predict(board.plain[board.reached])
        grade = board.grade[board.reached]
        lines += [_with_grades(name, count, difficulty, grade, errors) for count in _GIVEN]
    return lines


def _with_grades(name: str, count: int, difficulty: Floats, grade: Floats, errors: Errors) -> str:
    rows = []
    for draw in range(_DRAWS):
        order = np.random.default_rng(draw).permutation(len(difficulty))
        given, others = order[:count], order[count : count + 2000]
        fitted = calibrate([Known(float(difficulty[k]), float(grade[k])) for k in given], errors)
        middles = np.array([fitted.grade_at(float(difficulty[k]))[0] for k in others])
        ends = [fitted.range(float(difficulty[k])) for k in others]
        true = grade[others]
        off = np.abs(np.round(middles) - true)
        inside = [one.low <= t <= one.high for one, t in zip(ends, true, strict=True)]
        wide = [one.high - one.low + 1 for one in ends]
        rows.append(((off <= 1).mean(), off.mean(), np.mean(inside), np.mean(wide)))
    near, mae, inside_mean, wide_mean = np.mean(rows, axis=0)
    return f"| {name} | {count} | {near:.3f} | {mae:.2f} | {inside_mean:.3f} | {wide_mean:.1f} |"


def movement(found: dict[str, TrainingBoard]) -> list[str]:
    """Return the share of tops reached, and the CPU-seconds of a sequence."""
    lines = [
        "| set-up | problems | top reached | CPU-s, median | 99 % | worst |",
        "|---|---|---|---|---|---|",
    ]
    for name, board in found.items():
        low, high, worst = np.quantile(board.seconds, [0.5, 0.99, 1.0])
        lines.append(
            f"| {name} | {len(board.problems)} | {board.reached.mean():.4f} | "
            f"{low:.3f} | {high:.3f} | {worst:.3f} |"
        )
    return lines


REPORTS: dict[str, Callable[[dict[str, TrainingBoard]], list[str]]] = {
    "report": report,
    "carried": carried,
    "both": both,
    "gym": gym,
    "movement": movement,
}


def main(arguments: list[str]) -> int:
    fits = arguments[:1] == ["fit"]
    before, setups = arguments[: 4 if fits else 3], arguments[4 if fits else 3 :] or list(SETUPS)
    if (
        len(before) < (4 if fits else 3)
        or set(setups) - {*SETUPS}
        or before[0] not in {"fit", *REPORTS}
    ):
        print(__doc__)
        return 2
    what, data, cache = before[:3]
    found = training_boards(Path(data), Path(cache), available_cores(), setups)
    if fits:
        write_model(fit_on(list(found.values())), list(found.values()), Path(before[3]))
        return 0
    print("\n".join(REPORTS[what](found)))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
