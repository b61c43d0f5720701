"""Build the containers' image and play a gym's day in it: `make containers`.

    python -m gym.benchmarks.containers [--image NAME] [--photos DIR]

Nothing is pulled: mmdebstrap makes a base image of Debian's packages, buildah builds
`gym/deploy/Containerfile` on it (vfs, chroot isolation, the network of the host). A server and a
worker then run in containers of that image, on a PostgreSQL and an S3 store (moto) of the host.
Chromium plays the way from signing up to what a climber sees; a backup is written and restored into
an empty database and bucket by containers, too. Needs root, mmdebstrap, buildah, PostgreSQL, node
and Chromium.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx
import psutil
import sqlalchemy
from gym.tests.postgres import Postgres, postgres_programs
from gym.tests.running import wait_for
from gym.tests.worlds import PASSWORD
from moto.server import ThreadedMotoServer

_ROOT = Path(__file__).resolve().parents[2]
_TINY = _ROOT / "tests" / "data" / "tiny-gym"
_BASE, _IMAGE, _USER = "localhost/walltopo-base", "localhost/walltopo-gym", 10001
_PATIENCE_S = 7200


class Images:
    """Images and containers in a folder of their own."""

    def __init__(self, folder: Path) -> None:
        self._words = ["buildah", "--storage-driver", "vfs", "--root", str(folder / "store")]
        self._words += ["--runroot", str(folder / "run")]
        self._environment = os.environ | {"BUILDAH_ISOLATION": "chroot"}

    def call(self, *words: str | Path) -> str:
        """Run buildah; return its output.

        Raises
        ------
        SystemExit : it fails.
        """
        command = [*self._words, *map(str, words)]
        done = subprocess.run(
            command, cwd=_ROOT, env=self._environment, capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(command)}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        return done.stdout.strip()

    def make_base(self, folder: Path) -> None:
        """Make an image of Debian 12 with Python; pip is at its usual place."""
        packed = folder / "base.tar"
        packages = "--include=python3,python3-dev,python3-venv,ca-certificates"
        command = ["mmdebstrap", "--quiet", "--variant=minbase", packages, "bookworm", str(packed)]
        subprocess.run(command, check=True)
        container = self.call("from", "scratch")
        self.call("add", container, packed, "/")
        self.call("run", container, "--", "python3", "-m", "venv", "/usr/local")
        path = "PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
        self.call("config", "--env", path, container)
        # As in Python's own images: Debian's pip is too old for archives without pyproject.toml.
        pip = ["/usr/local/bin/pip", "install", "--quiet", "--upgrade", "pip", "setuptools"]
        self.call("run", "--network=host", *self._pip_of_host(), container, "--", *pip)
        self.call("commit", container, _BASE)
        self.call("rm", container)

    def build(self) -> None:
        """Build the platform's image; pip inside finds packages as it does on the host."""
        words = ["--layers=false", "--network=host", f"--build-arg=BASE={_BASE}"]
        words += self._pip_of_host()
        self.call("bud", *words, "--tag", _IMAGE, "--file", "gym/deploy/Containerfile", ".")

    def _pip_of_host(self) -> list[str]:
        """Return the mounts by which pip finds its index as it does on the host."""
        places = ("/etc/pip.conf", str(Path.home() / ".config/pip"), "/etc/ssl/certs", "/opt")
        return [f"--volume={place}:{place}:ro" for place in places if Path(place).exists()]

    def size(self) -> str:
        """Return the size of the platform's image."""
        return self.call("images", "--format", "{{.Size}}", _IMAGE)

    def command(self, data: Path, environment: dict[str, str], *words: str) -> list[str]:
        """Return the command that runs `walltopo gym WORDS` in a new container."""
        container = self.call("from", _IMAGE)
        settings = [f"--env={name}={value}" for name, value in environment.items()]
        mounts = [f"--volume={data}:/data", f"--volume={backups(data)}:/backups"]
        return [
            *self._words,
            "run",
            "--network=host",
            *mounts,
            *settings,
            container,
            "--",
            "walltopo",
            "gym",
            *words,
        ]


def backups(data: Path) -> Path:
    """Return the folder of backups beside a data folder; all containers see it."""
    return data.parent / "backups"


class Day:
    """The containers of one gym: environment, data folder, and how to run commands."""

    def __init__(
        self, images: Images, folder: Path, name: str, postgres: Postgres, s3: str
    ) -> None:
        self.data = folder / name
        for place in (self.data, backups(self.data)):
            place.mkdir(exist_ok=True)
            os.chown(place, _USER, _USER)
        self.database = f"postgresql://{postgres.address}/{name}"
        with _engine(f"postgresql://{postgres.address}/postgres") as connection:
            connection.execute(sqlalchemy.text(f"CREATE DATABASE {name}"))
        httpx.put(f"{s3}/{name}").raise_for_status()
        self._images = images
        self._environment = {
            "WALLTOPO_GYM_DATABASE": self.database,
            "WALLTOPO_GYM_OBJECTS": f"s3://{name}",
            "WALLTOPO_GYM_WORKERS": "0",
            "WALLTOPO_GYM_NEW_GYMS": "anyone",
            "AWS_ENDPOINT": s3,
            "AWS_ALLOW_HTTP": "true",
            "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": "gym",
            "AWS_SECRET_ACCESS_KEY": "gym",
        }

    @contextmanager
    def running(self, log: Path, *words: str) -> Iterator[None]:
        """Run a command in a container during the block; its output goes to a file."""
        command = self._images.command(self.data, self._environment, *words)
        with log.open("ab") as stream:
            child = subprocess.Popen(
                command,
                stdout=stream,
                stderr=stream,
                env=os.environ | {"BUILDAH_ISOLATION": "chroot"},
            )
            try:
                yield
                if child.poll() is not None:
                    raise SystemExit(f"{words[0]} ended:\n{log.read_text()[-3000:]}")
            finally:
                inside = psutil.Process(child.pid).children(recursive=True)
                for process in inside:
                    process.terminate()
                psutil.wait_procs(inside, timeout=60)
                child.wait()

    def call(self, *words: str) -> str:
        """Run a command in a container to its end; return its output."""
        command = self._images.command(self.data, self._environment, *words)
        done = subprocess.run(
            command,
            env=os.environ | {"BUILDAH_ISOLATION": "chroot"},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise SystemExit(f"walltopo gym {' '.join(words)}\n{done.stdout}{done.stderr}")
        return done.stdout

    def rows(self) -> dict[str, int]:
        """Return the number of rows of each table of the platform."""
        with _engine(self.database) as connection:
            names = sqlalchemy.inspect(connection).get_table_names(schema="public")
            count = "SELECT count(*) FROM {}"
            return {n: connection.scalar(sqlalchemy.text(count.format(n))) or 0 for n in names}


@contextmanager
def _engine(url: str) -> Iterator[sqlalchemy.Connection]:
    engine = sqlalchemy.create_engine(
        url.replace("postgresql://", "postgresql+psycopg://"), isolation_level="AUTOCOMMIT"
    )
    with engine.connect() as connection:
        yield connection
    engine.dispose()


def play(day: Day, folder: Path, photos: Path) -> None:
    """Play the way through the browser: sign-up, photos, scan, publication, a climber's look."""
    log = folder / "serve.log"
    with (
        day.running(log, "serve", "--port", "0"),
        day.running(folder / "worker.log", "worker"),
    ):
        found = wait_for(lambda: re.search(r"http://[\d.]+:(\d+)", log.read_text()))
        places = {
            "address": f"http://localhost:{found[1]}",
            "log": str(log),
            "password": PASSWORD,
            "photos": str(photos.absolute()),
            "shots": str(folder),
        }
        (folder / "places.json").write_text(json.dumps(places))
        ended = subprocess.run(
            ["node", "tests/whole_way.mjs", str(folder / "places.json")],
            cwd=_ROOT / "gym/web",
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            check=False,
        )
        print(ended.stdout, end="")
        if ended.returncode:
            raise SystemExit(f"the browser came to no end: {ended.stderr[-3000:]}")


def back_up_and_restore(day: Day, empty: Day) -> None:
    """Write a backup by a container, restore it by another one, and compare all rows."""
    day.call("backup", "/backups/gym.tar")
    print(f"backup: {(backups(day.data) / 'gym.tar').stat().st_size / 1e6:.1f} MB")
    empty.call("restore", "/backups/gym.tar")
    before, after = day.rows(), empty.rows()
    if differing := {n for n in before if before[n] != after.get(n)}:
        raise SystemExit(f"restored other numbers of rows: {', '.join(sorted(differing))}")
    print(f"restored: {sum(after.values())} rows of {len(after)} tables, as many as before")
    empty.call("doctor")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--photos", type=Path, default=_TINY)
    parser.add_argument("--folder", type=Path, help="kept; images in it are not built again")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kept = args.folder or folder
        images = Images(kept)
        if _IMAGE not in images.call("images", "--format", "{{.Name}}"):
            began = time.monotonic()
            images.make_base(folder)
            images.build()
            print(f"image built in {time.monotonic() - began:.0f} s")
        print(f"image: {images.size()}")
        programs = postgres_programs()
        if programs is None:
            raise SystemExit("PostgreSQL is not installed (Debian: apt-get install postgresql)")
        postgres, store = Postgres(programs, fsync=False), ThreadedMotoServer(port=0, verbose=False)
        postgres.start()
        store.start()
        try:
            s3 = "http://{}:{}".format(*store.get_host_and_port())
            days = [Day(images, folder, word, postgres, s3) for word in ("walls", "restored")]
            play(days[0], folder, args.photos)
            back_up_and_restore(*days)
        finally:
            store.stop()
            postgres.close()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
