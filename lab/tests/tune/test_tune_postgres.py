"""Workers that share a PostgreSQL database; on the server of the tests."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

DRIVERS = ("pg8000", "psycopg", "psycopg2")


@pytest.fixture
def database(postgres: str, lacks: Callable[[str], NoReturn]) -> str:
    """URL of an empty database."""
    driver = next((name for name in DRIVERS if importlib.util.find_spec(name)), None)
    if driver is None:
        lacks(f"no PostgreSQL driver ({', '.join(DRIVERS)}): pip install pg8000")
    return f"postgresql+{driver}://{postgres}/postgres"


@pytest.mark.slow
def test_two_machines_share_a_search(
    tmp_path: Path, make_gym: Callable[[Path], None], database: str
) -> None:
    """Two commands, started at the same time on an empty database, do one search together.

    One of the two may do all trials before the other has started, so a third one joins later.
    """
    import optuna

    make_gym(tmp_path / "t")
    (tmp_path / "walls.toml").write_text('[[wall]]\nname="a"\nuse="train"\ntruth="t"\n')
    command = [sys.executable, "-m", "walltopo", "tune", "lift", str(tmp_path / "walls.toml")]

    def started(machine: int, trials: int) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [
                *command,
                "--trials",
                str(trials),
                "--storage",
                database,
                "-o",
                str(tmp_path / f"machine{machine}"),
                "--seed",
                str(machine),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    for processes in ([started(0, 8), started(1, 8)], [started(2, 12)]):
        output = [process.communicate()[0] for process in processes]
        assert all(process.returncode == 0 for process in processes), output
    study = optuna.load_study(study_name="lift-robust-ap", storage=database)
    done = study.get_trials(states=(optuna.trial.TrialState.COMPLETE,))
    assert 12 <= len(done) <= 13
    assert len({trial.user_attrs["worker"] for trial in done}) >= 2
    for k in range(3):
        assert (tmp_path / f"machine{k}/walltopo.toml").is_file()
