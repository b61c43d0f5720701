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
    """Two commands, started at the same time on an empty database, do one search together."""
    import optuna

    make_gym(tmp_path / "t")
    (tmp_path / "walls.toml").write_text('[[wall]]\nname="a"\nuse="train"\ntruth="t"\n')
    command = [sys.executable, "-m", "walltopo", "tune", "lift", str(tmp_path / "walls.toml")]
    command += ["--trials", "12", "--storage", database]
    processes = [
        subprocess.Popen(
            [*command, "-o", str(tmp_path / f"machine{k}"), "--seed", str(k)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for k in range(2)
    ]
    output = [process.communicate(timeout=240)[0] for process in processes]
    assert [process.returncode for process in processes] == [0, 0], output
    study = optuna.load_study(study_name="lift-robust-ap", storage=database)
    done = study.get_trials(states=(optuna.trial.TrialState.COMPLETE,))
    assert 12 <= len(done) <= 13
    assert len({trial.user_attrs["worker"] for trial in done}) == 2, output
    for k in range(2):
        assert (tmp_path / f"machine{k}/walltopo.toml").is_file()
