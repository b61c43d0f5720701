"""Run the tests of one tier, and run what failed once more.

    python run_tests.py quick|all [--workers N] [options of pytest]

A test that fails is run a second time, alone, after all others. If it passes then, the last lines
list it as FLAKY, and the run counts as green while there are at most three such tests. A test that
fails twice fails the run. There is no other retry: a flaky test is a defect to mend.

This file is also the pytest plugin that reports the failures of one run to `main`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import pytest

MAX_FLAKY = 3
# More failures than this are no coincidence: they are not run again.
MAX_RETRIED = 10
# A quick test that takes longer on a slow machine still passes; the last lines name it.
QUICK_SECONDS = 15.0
LONGEST = 25  # files that the whole tier lists by their time
ROOT = Path(__file__).resolve().parent
TIERS = {"quick": ["-m", "not slow"], "all": ["--hypothesis-profile", "random"]}
FAILED, ONLY = "WALLTOPO_TESTS_FAILED", "WALLTOPO_TESTS_ONLY"


class _Failures:
    """Plugin of the first run: names each failed test at once, and writes all with their errors."""

    def __init__(self, target: Path, plugins: pytest.PytestPluginManager) -> None:
        self._target = target
        self._plugins = plugins
        self._errors: dict[str, str] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and report.nodeid not in self._errors:
            crash = getattr(report.longrepr, "reprcrash", None)
            lines = (crash.message if crash else str(report.longrepr)).strip().splitlines()
            error = lines[0] if lines else "no message"
            self._errors[report.nodeid] = error
            terminal: pytest.TerminalReporter = self._plugins.getplugin("terminalreporter")
            terminal.ensure_newline()
            terminal.write_line(f"failed: {report.nodeid}: {error[:200]}")

    def pytest_sessionfinish(self) -> None:
        self._target.write_text(json.dumps(self._errors))


class _Slow:
    """Plugin of the quick tier: lists the tests that belong into the slow one."""

    def __init__(self) -> None:
        self._seconds: dict[str, float] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" and report.duration > QUICK_SECONDS:
            self._seconds[report.nodeid] = report.duration

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        for name, seconds in sorted(self._seconds.items(), key=lambda item: -item[1]):
            terminalreporter.write_line(f"slow in the quick tier: {name} took {seconds:.0f} s")


class _Files:
    """Plugin of the whole tier: lists the files that take longest, set-up included."""

    def __init__(self) -> None:
        self._seconds: dict[str, float] = defaultdict(float)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._seconds[report.nodeid.split("::")[0]] += report.duration

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        longest = sorted(self._seconds.items(), key=lambda item: -item[1])
        whole = sum(self._seconds.values())
        terminalreporter.write_line(f"{whole:.0f} s in all processes; the longest files:")
        for name, seconds in longest[:LONGEST]:
            terminalreporter.write_line(f"{seconds:7.0f} s  {name}")


def pytest_configure(config: pytest.Config) -> None:
    """Register the plugins in the process that sees the reports of all others."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        return
    if FAILED in os.environ:
        failures = _Failures(Path(os.environ[FAILED]), config.pluginmanager)
        config.pluginmanager.register(failures)
    if config.getoption("markexpr") == "not slow":
        config.pluginmanager.register(_Slow())
    else:
        config.pluginmanager.register(_Files())


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """In the second run, keep the tests that failed in the first."""
    if ONLY in os.environ:
        wanted = set(json.loads(Path(os.environ[ONLY]).read_text()))
        config.hook.pytest_deselected(items=[i for i in items if i.nodeid not in wanted])
        items[:] = [item for item in items if item.nodeid in wanted]


def main(words: Sequence[str]) -> int:
    """Run a tier; return pytest's exit code, or 0 if a second run of the failed tests is green."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("tier", choices=TIERS)
    parser.add_argument("--workers", default="3", help="processes; 0: this one (default: 3)")
    arguments, more = parser.parse_known_args(words)
    # A file stays in one process; the files come in the order of conftest.py.
    spread = ["-n", arguments.workers, "--dist", "loadfile", "--no-loadscope-reorder"]
    with tempfile.TemporaryDirectory() as folder:
        failed = Path(folder) / "failed.json"
        # In the checkout, pytest-cov would add up what another run, or a killed one, left there.
        counted = {"COVERAGE_FILE": str(Path(folder) / "coverage")}
        code = _pytest([*spread, *TIERS[arguments.tier], *more], {FAILED: str(failed), **counted})
        if code != pytest.ExitCode.TESTS_FAILED or not failed.is_file():
            return code
        errors: dict[str, str] = json.loads(failed.read_text())
        if not errors or len(errors) > MAX_RETRIED:
            return code
        print(f"{len(errors)} failed and run once more, alone:", flush=True)
        again = Path(folder) / "again.json"
        files = sorted({name.split("::")[0] for name in errors})
        _pytest([*TIERS[arguments.tier], *files], {ONLY: str(failed), FAILED: str(again)})
        if not again.is_file():
            return code
        return _verdict(errors, set(json.loads(again.read_text())))


def _pytest(options: Sequence[str], variables: dict[str, str]) -> int:
    words = [sys.executable, "-m", "pytest", "-p", "run_tests", *options]
    return subprocess.run(words, cwd=ROOT, env={**os.environ, **variables}, check=False).returncode


def _verdict(errors: dict[str, str], failed_twice: set[str]) -> int:
    """Print which tests failed twice and which are flaky; return 0 if the run counts as green."""
    for name in sorted(failed_twice):
        print(f"FAILED twice {name}")
    flaky = sorted(errors.keys() - failed_twice)
    for name in flaky:
        print(f"FLAKY {name}: {errors[name]}")
    if len(flaky) > MAX_FLAKY:
        print(f"{len(flaky)} flaky tests in one run; at most {MAX_FLAKY} are accepted")
    return int(bool(failed_twice) or len(flaky) > MAX_FLAKY)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
