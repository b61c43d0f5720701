"""A PostgreSQL server of our own in a folder of its own, which can be killed and started again."""

from __future__ import annotations

import os
import random
import shutil
import socket
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path

import psutil

__all__ = ["Postgres", "free_port", "postgres_programs"]


def postgres_programs() -> Path | None:
    """The folder of initdb and pg_ctl, which Debian does not put on the path."""
    found = shutil.which("initdb")
    folders = [Path(found).parent] if found else []
    folders += sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    wanted = ("initdb", "pg_ctl")
    return next((f for f in folders if all((f / name).is_file() for name in wanted)), None)


class Postgres:
    """A server that trusts every client; `address` is `tester@host:port`.

    Parameters
    ----------
    programs : the folder of PostgreSQL's programs.
    fsync : off is faster, and no worse as long as the machine itself goes on.
    """

    def __init__(self, programs: Path, *, fsync: bool) -> None:
        self._programs = programs
        # Not in TMPDIR, which another user may not be allowed to enter; sockets need a short path.
        self._place = Path(tempfile.mkdtemp(prefix="walltopo-postgres-", dir="/tmp"))
        # The server refuses to run as root.
        self._user = "nobody" if os.getuid() == 0 else None
        if self._user:
            shutil.chown(self._place, self._user)
        port = free_port()
        self.address = f"tester@127.0.0.1:{port}"
        self._options = f"-k {self._place} -p {port} -c listen_addresses=127.0.0.1"
        self._options += f" -c fsync={'on' if fsync else 'off'}"
        self._call(
            "initdb",
            "-D",
            self._data,
            "-A",
            "trust",
            "-U",
            "tester",
            "--no-sync",
            "--no-locale",
            "-E",
            "UTF8",
        )

    @property
    def _data(self) -> str:
        return f"{self._place}/db"

    def start(self) -> None:
        """Start it, after a kill too: it then recovers what it had acknowledged."""
        self._call(
            "pg_ctl",
            "-D",
            self._data,
            "-w",
            "-t",
            "600",
            "-o",
            self._options,
            "-l",
            f"{self._place}/server.log",
            "start",
        )

    def kill(self) -> None:
        """SIGKILL to the server and to all of its processes."""
        server = psutil.Process(int((self._place / "db/postmaster.pid").read_text().split()[0]))
        processes = [server, *server.children(recursive=True)]
        for process in processes:
            with suppress(psutil.NoSuchProcess):
                process.kill()
        psutil.wait_procs(processes)

    def close(self) -> None:
        """Stop it, and remove all that it kept."""
        if (self._place / "db/postmaster.pid").is_file():
            self._call("pg_ctl", "-D", self._data, "-m", "immediate", "stop")
        shutil.rmtree(self._place)

    def _call(self, program: str, *words: str) -> None:
        command = [str(self._programs / program), *words]
        with (self._place / "log").open("ab") as log:
            subprocess.run(
                command, check=True, user=self._user, cwd=self._place, stdout=log, stderr=log
            )


def free_port() -> int:
    """Return a port of this machine that nothing listens at.

    The system gives none of these to a process that asks for any port: such a process could bind
    it before the server does. Browsers refuse some ports below 11,000.
    """
    own = Path("/proc/sys/net/ipv4/ip_local_port_range")
    lowest = int(own.read_text().split()[0]) if own.is_file() else 32_768
    ports = range(11_000, lowest) or range(11_000, 65_536)
    while True:
        port = random.SystemRandom().choice(ports)
        with suppress(OSError), socket.socket() as probe:
            probe.bind(("127.0.0.1", port))
            return port
