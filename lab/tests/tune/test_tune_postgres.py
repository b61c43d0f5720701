"""Workers that share a PostgreSQL database; a server of its own, under a temporary folder."""

from __future__ import annotations

import importlib.util
import os
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NoReturn

import pytest

DRIVERS = ("pg8000", "psycopg", "psycopg2")


def programs() -> Path | None:
    """The folder of initdb and pg_ctl, which Debian does not put on the path."""
    found = shutil.which("initdb")
    folders = [Path(found).parent] if found else []
    folders += sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    wanted = ("initdb", "pg_ctl")
    return next((f for f in folders if all((f / name).is_file() for name in wanted)), None)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def database(lacks: Callable[[str], NoReturn]) -> Iterator[str]:
    """URL of an empty database; the server ends with the test."""
    folder = programs()
    if folder is None:
        lacks("PostgreSQL is not installed (Debian: apt-get install postgresql)")
    driver = next((name for name in DRIVERS if importlib.util.find_spec(name)), None)
    if driver is None:
        lacks(f"no PostgreSQL driver ({', '.join(DRIVERS)}): pip install pg8000")
    place = Path(tempfile.mkdtemp(prefix="walltopo-postgres-"))
    # The server refuses to run as root.
    user = "nobody" if os.getuid() == 0 else None
    if user:
        shutil.chown(place, user)

    def call(program: str, *words: str) -> None:
        command = [str(folder / program), *words]
        with (place / "log").open("ab") as log:
            subprocess.run(command, check=True, user=user, cwd=place, stdout=log, stderr=log)

    port = free_port()
    try:
        call("initdb", "-D", f"{place}/db", "-A", "trust", "-U", "tuner")
        options = f"-k {place} -p {port} -c listen_addresses=127.0.0.1"
        call(
            "pg_ctl", "-D", f"{place}/db", "-w", "-o", options, "-l", f"{place}/server.log", "start"
        )
        yield f"postgresql+{driver}://tuner@127.0.0.1:{port}/postgres"
    finally:
        if (place / "db/postmaster.pid").is_file():
            call("pg_ctl", "-D", f"{place}/db", "-m", "immediate", "stop")
        shutil.rmtree(place)


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
    told = [process.communicate(timeout=240)[0] for process in processes]
    assert [process.returncode for process in processes] == [0, 0], told
    study = optuna.load_study(study_name="lift-robust-ap", storage=database)
    done = study.get_trials(states=(optuna.trial.TrialState.COMPLETE,))
    assert 12 <= len(done) <= 13
    assert len({trial.user_attrs["worker"] for trial in done}) == 2, told
    for k in range(2):
        assert (tmp_path / f"machine{k}/walltopo.toml").is_file()
