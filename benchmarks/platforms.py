"""List the wheels of all run-time dependencies for systems where nothing of ours was run.

    python -m benchmarks.platforms

pip resolves each dependency for each system and Python against its configured index, from wheels
alone and without installing. The versions are those of `constraints.txt` where they have a wheel. Each cell names
the Pythons that have a wheel; "any" is one wheel for all systems.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename

from walltopo.core import InputError

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.11", "3.12", "3.13")
# pip's messages if an index has no wheel, or none of the pinned version.
_NO_WHEEL = ("No matching distribution found", "ResolutionImpossible")


@dataclass(frozen=True)
class System:
    """A system for which pip chooses wheels.

    Parameters
    ----------
    tags : platform tags of wheels that it can install.
    markers : the environment of requirements' markers.
    """

    name: str
    tags: tuple[str, ...]
    markers: dict[str, str]

    def takes(self, want: Requirement, extras: Iterable[str], python: str) -> bool:
        """Return whether the requirement applies to this system."""
        if want.marker is None:
            return True
        known = {**self.markers, "python_version": python, "python_full_version": f"{python}.0"}
        return any(want.marker.evaluate({**known, "extra": extra}) for extra in ("", *extras))


MACOS = System(
    "macOS on arm64",
    tuple(f"macosx_{version}_0_arm64" for version in (11, 12, 13, 14)),
    {
        "sys_platform": "darwin",
        "platform_system": "Darwin",
        "os_name": "posix",
        "platform_machine": "arm64",
    },
)
WINDOWS = System(
    "Windows on x64",
    ("win_amd64",),
    {
        "sys_platform": "win32",
        "platform_system": "Windows",
        "os_name": "nt",
        "platform_machine": "AMD64",
    },
)


@dataclass(frozen=True)
class Wheel:
    """A wheel that pip chose: its file name, version and requirements."""

    file: str
    version: str
    requires: tuple[str, ...]

    @property
    def pure(self) -> bool:
        """Return whether the wheel is for all systems."""
        return all(tag.platform == "any" for tag in parse_wheel_filename(self.file)[3])


def choose(
    system: System, python: str, wants: Sequence[Requirement], *, pinned: bool = True
) -> dict[str, Wheel]:
    """Return the wheels that pip chooses, by package; those without a wheel are absent.

    Parameters
    ----------
    pinned : try the version of `constraints.txt` before others.

    Raises
    ------
    InputError : pip fails for another reason than a lack of wheels.
    """
    done, report = _pip(system, python, wants, pinned=pinned)
    if report is not None:
        return {
            canonicalize_name(item["metadata"]["name"]): Wheel(
                item["download_info"]["url"].rsplit("/", 1)[-1],
                item["metadata"]["version"],
                tuple(item["metadata"].get("requires_dist", ())),
            )
            for item in report["install"]
        }
    if not any(reason in done.stderr for reason in _NO_WHEEL):
        raise InputError(f"pip failed: {done.stderr.strip()[-300:]}")
    if len(wants) > 1:
        half = len(wants) // 2
        parts = (choose(system, python, part) for part in (wants[:half], wants[half:]))
        return {name: wheel for part in parts for name, wheel in part.items()}
    return choose(system, python, wants, pinned=False) if pinned else {}


def _pip(
    system: System, python: str, wants: Sequence[Requirement], *, pinned: bool
) -> tuple[subprocess.CompletedProcess[str], dict[str, Any] | None]:
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-deps", "--quiet"]
        command += ["--ignore-installed", "--only-binary=:all:", "--target", folder]
        command += ["--report", str(report), "--python-version", python]
        command += ["--constraint", str(ROOT / "constraints.txt")] if pinned else []
        command += [f"--platform={tag}" for tag in system.tags]
        command += [f"{want.name}{want.specifier}" for want in wants]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return done, json.loads(report.read_bytes()) if done.returncode == 0 else None


def all_wheels(
    system: System, python: str, wants: Sequence[Requirement]
) -> dict[str, Wheel | None]:
    """Return the wheels of requirements and of all that those require; None for a missing one."""
    found: dict[str, Wheel | None] = {}
    ahead = [(want, system.takes(want, (), python)) for want in wants]
    while new := [want for want, taken in ahead if taken and _name(want) not in found]:
        chosen = choose(system, python, new)
        ahead = []
        for want in new:
            wheel = found[_name(want)] = chosen.get(_name(want))
            for line in wheel.requires if wheel else ():
                inner = Requirement(line)
                ahead.append((inner, system.takes(inner, want.extras, python)))
    return found


def _name(want: Requirement) -> str:
    return canonicalize_name(want.name)


def main() -> int:
    """Print the table and the packages without a wheel."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wants = [Requirement(line) for line in project["dependencies"]]
    systems = (MACOS, WINDOWS)
    tables = {s.name: {p: all_wheels(s, p, wants) for p in PYTHONS} for s in systems}
    names = sorted({name for t in tables.values() for found in t.values() for name in found})
    lines = [f"| package | version | {' | '.join(s.name for s in systems)} |", "|---|---|---|---|"]
    for name in names:
        cells = [_cell(name, tables[s.name]) for s in systems]
        lines.append(f"| {name} | {_versions(name, tables.values())} | {' | '.join(cells)} |")
    for system in systems:
        counts = [_count(python, tables[system.name][python]) for python in PYTHONS]
        lines.append(f"{system.name}: {'; '.join(counts)}")
    lines.append(f"newest macOS that a wheel needs: {_newest_macos(tables[MACOS.name])}")
    sys.stdout.write("\n".join(lines) + "\n")
    return 0


def _cell(name: str, table: dict[str, dict[str, Wheel | None]]) -> str:
    wheels = {python: found[name] for python, found in table.items() if name in found}
    if not wheels:
        return "not needed"
    if all(wheel is not None and wheel.pure for wheel in wheels.values()):
        return "any"
    there = [python for python, wheel in wheels.items() if wheel]
    return ", ".join(there) or "**none**"


def _versions(name: str, tables: Iterable[dict[str, dict[str, Wheel | None]]]) -> str:
    found = (table[python].get(name) for table in tables for python in PYTHONS)
    return ", ".join(sorted({wheel.version for wheel in found if wheel})) or "?"


def _newest_macos(table: dict[str, dict[str, Wheel | None]]) -> str:
    wheels = [(name, w) for found in table.values() for name, w in found.items() if w]
    needed = {name: int(m[1]) for name, w in wheels if (m := re.search(r"macosx_(\d+)_", w.file))}
    newest = max(needed.values(), default=0)
    return (
        f"{newest} ({', '.join(sorted(n for n, version in needed.items() if version == newest))})"
    )


def _count(python: str, found: dict[str, Wheel | None]) -> str:
    missing = [name for name, wheel in found.items() if wheel is None]
    lack = f" (none of {', '.join(missing)})" if missing else ""
    return f"Python {python}: {len(found) - len(missing)} of {len(found)} have a wheel{lack}"


if __name__ == "__main__":
    sys.exit(main())
