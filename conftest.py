"""Fixtures that all tests share."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import pytest
from hypothesis import HealthCheck, settings
from tests.breakpoints.breakpoint import Breakpoint
from xdist.scheduler import LoadFileScheduling  # type: ignore[import-untyped]

from walltopo.core.locks import take_lock

_PROXIES = {"HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "NO_PROXY"}
_OF_PYTHON = {"PYTHONWARNINGS", "PYTHONDEVMODE"}  # they write to a child's stderr


def _pin_environment() -> None:
    """Let the tests' processes be the same on every machine.

    Requests to servers of the tests take no proxy, the store has no credentials but those of a
    test, programs speak English, and numerical libraries add up in one order in every process.
    This comes before NumPy is loaded; workers of pytest-xdist begin with it.
    """
    for name in list(os.environ):
        if name.upper() in _PROXIES or name in _OF_PYTHON or name.startswith("AWS_"):
            del os.environ[name]
    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    if sys.platform == "linux":
        os.environ["LC_ALL"] = "C.UTF-8"


_pin_environment()

# How fast a machine is at the moment says nothing about the code. A test's settings that name other
# health checks replace this list.
_PATIENT = settings(
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
# The check of a commit draws the same examples each time; `make test-all` draws new ones.
settings.register_profile("same", _PATIENT, derandomize=True)
settings.register_profile("random", _PATIENT)
settings.load_profile("same")

# Tests of these files run in several processes; any other file stays in one, with its fixtures.
_SPREAD = ("gym/tests/web/test_gym_app.py", "tests/publish/test_viewer_browser.py")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what runs in `make test-all` alone, and begin with the files that take longest."""
    for item in items:
        if "postgresql" in _databases(item) and not item.get_closest_marker("both_databases"):
            item.add_marker(pytest.mark.slow)
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: (not item.nodeid.startswith(_SPREAD), item.path not in slow))


class _Spread(LoadFileScheduling):
    """Hands out files whole, but for those of `_SPREAD`."""

    def _split_scope(self, nodeid: str) -> str:
        return nodeid if nodeid.startswith(_SPREAD) else super()._split_scope(nodeid)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> _Spread:
    """Replace the schedulers of pytest-xdist."""
    return _Spread(config, log)


def _databases(item: pytest.Item) -> list[object]:
    """The database that a test of the platform runs on, where it runs on each of two."""
    call = getattr(item, "callspec", None)
    return [] if call is None else [v for v in call.params.values() if isinstance(v, str)]


def _data_root() -> Path:
    return Path(
        os.environ.get(
            "WALLTOPO_TEST_DATA", Path(__file__).resolve().parents[1] / "shared" / "data"
        )
    )


@pytest.fixture(scope="session")
def lacks() -> Callable[[str], NoReturn]:
    """Called where a test cannot run: skips it, and fails in CI, where nothing may be lacking."""

    def tell(what: str) -> NoReturn:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(what)

    return tell


@pytest.fixture(scope="session")
def data_root(lacks: Callable[[str], NoReturn]) -> Path:
    """The folder of test data beside the checkout."""
    root = _data_root()
    if not (root / "README.md").is_file():
        lacks(f"test data not found at {root} (set WALLTOPO_TEST_DATA)")
    return root


@pytest.fixture(scope="session")
def gym_a(data_root: Path) -> Path:
    """The rendered gym with exact ground truth."""
    return data_root / "gym-a"


@pytest.fixture
def child_breakpoint(tmp_path_factory: pytest.TempPathFactory) -> Breakpoint:
    """Stops a child process at a place."""
    return Breakpoint(tmp_path_factory.mktemp("breakpoint") / "reached")


Once = Callable[[str, Callable[[Path], object]], Path]


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Once:
    """`once(name, make)`: a folder that `make` fills, once for all processes of pytest-xdist."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def made(name: str, make: Callable[[Path], object]) -> Path:
        out = shared / name
        with (shared / f"{name}-lock").open("w") as lock:
            take_lock(lock, wait=True)
            if not out.exists():
                # An attempt that fails leaves nothing that the next one would take for whole.
                part = Path(tempfile.mkdtemp(dir=shared)) / name
                make(part)
                part.rename(out)
        return out

    return made


@pytest.fixture(scope="session")
def tiny_photos() -> Path:
    """Return eight photos of `walltopo_lab.synth.write_tiny_gym`; nobody changes them."""
    return Path(__file__).parent / "tests" / "data" / "tiny-gym"


@pytest.fixture(scope="session")
def tiny_scan(tiny_photos: Path, once: Once) -> Path:
    """A finished scan of the small rendered gym; who changes it works on a copy.

    Small and quick, and the same bytes on every run.
    """
    from walltopo.pipeline.runner import scan
    from walltopo.pipeline.settings import load_settings

    settings = load_settings(None, ["sparse.threads=1", "texture.size=512"])
    return once("tiny-scan", lambda out: scan(tiny_photos, out, settings))


@pytest.fixture(scope="session")
def reset_day(once: Once) -> Path:
    """A generated wall before and after the reset of its left half, and scans; nobody changes them.

    `before` and `after` are the wall with its truth; `old` is the scan of the wall before, `left`
    about 12 photos of the left half after the reset, and `joined` their partial rescan.
    """
    from benchmarks.partial_rescan import rescan_left_half

    from walltopo_lab.synth.small import tiny_recipe

    small = tiny_recipe(24, (640, 480), seed=3)
    recipe = replace(small, gym=replace(small.gym, width=4.0, columns=4, routes=5, volumes=2))
    settings = ["sparse.threads=1", "texture.size=1024"]
    return once("reset-day", lambda out: rescan_left_half(out, recipe, settings))


@pytest.fixture(scope="session")
def openmvs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the OpenMVS programs: those on PATH, else those beside the test data."""
    found = shutil.which("ReconstructMesh")
    if found is not None:
        return Path(found).parent
    packed = sorted((_data_root().parent / "openmvs").glob("*.tar.xz"))
    if not packed:
        pytest.skip("OpenMVS is neither on PATH nor beside the test data")
    folder = tmp_path_factory.mktemp("openmvs")
    # By its program: Python 3.11.2, which Debian 12 has, knows no filter yet.
    subprocess.run(["tar", "-xJf", str(packed[-1]), "-C", str(folder)], check=True)
    for program in sorted(folder.iterdir()):
        run = subprocess.run([program, "--help"], cwd=folder, capture_output=True, text=True)
        if "shared libraries" in run.stderr:
            pytest.skip(f"OpenMVS does not start here: {run.stderr.strip()}")
    return folder


@pytest.fixture(scope="session")
def postgres(lacks: Callable[[str], NoReturn]) -> Iterator[str]:
    """`tester@host:port` of a PostgreSQL server of our own; it ends with the tests."""
    from gym.tests.postgres import Postgres, postgres_programs

    programs = postgres_programs()
    if programs is None:
        lacks("PostgreSQL is not installed (Debian: apt-get install postgresql)")
    server = Postgres(programs, fsync=False)
    try:
        server.start()
        yield server.address
    finally:
        server.close()
