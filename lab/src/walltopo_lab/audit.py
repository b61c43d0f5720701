"""`python -m walltopo_lab.audit` (`make audit`): known weaknesses of what the packages are made of.

pip-audit asks PyPI about what is installed here, npm its registry about what the two lock files
pin. What could not be asked about is said, and is no pass: the exit code is 1 where a weakness is
known, 2 where something was not asked, 0 where all was and nothing is known.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

_ROOT: Final = Path(__file__).resolve().parents[3]
_NPM: Final = ("viewer", "gym/web")
# Ours, from this checkout: no registry knows them.
_OWN: Final = ("walltopo", "walltopo-climb", "walltopo-lab", "walltopo-gym")


@dataclass(frozen=True)
class Asked:
    """What a registry said.

    Parameters
    ----------
    where : which registry, and of what.
    packages : how many it was asked about.
    weak : what is known, a line each; silent : what was not asked about and why, a line each.
    """

    where: str
    packages: int = 0
    weak: tuple[str, ...] = ()
    silent: tuple[str, ...] = ()


def of_python(told: str, failed: str) -> Asked:
    """What pip-audit said.

    Parameters
    ----------
    told : its JSON; failed : what it said else, which is why where there is no JSON.
    """
    where = "PyPI, what is installed here"
    found = _json(told)
    if found is None:
        return Asked(where, silent=(f"everything: {_last_line(failed)}",))
    weak, silent, packages = [], [], 0
    for row in found["dependencies"]:
        if row["name"] in _OWN:
            continue
        if "skip_reason" in row:
            silent.append(str(row["skip_reason"]))
            continue
        packages += 1
        for known in row["vulns"]:
            mended = ", ".join(known["fix_versions"]) or "no version yet"
            weak.append(f"{row['name']} {row['version']}: {known['id']} (mended in {mended})")
    return Asked(where, packages, tuple(weak), tuple(silent))


def of_npm(folder: str, told: str, failed: str) -> Asked:
    """What `npm audit` said of a folder; `told` and `failed` as of `of_python`."""
    where = f"npm, what {folder} ships"
    found = _json(told)
    if found is None or "vulnerabilities" not in found:
        why = (found or {}).get("message") or _last_line(failed)
        return Asked(where, silent=(f"everything: {why}",))
    weak = [f"{name} {row['range']}: {row['severity']}"
            for name, row in found["vulnerabilities"].items()]  # fmt: skip
    return Asked(where, found["metadata"]["dependencies"]["prod"], tuple(weak))


def report(asked: Sequence[Asked]) -> str:
    """All of it in words."""
    lines = []
    for one in asked:
        known = f"{len(one.weak)} known weaknesses" if one.weak else "no known weakness"
        lines.append(f"{one.where}: {one.packages} packages asked about, {known}")
        lines += [f"  {line}" for line in one.weak]
        if one.silent:
            lines.append(f"{one.where}: NOT ASKED about {len(one.silent)}")
            lines += [f"  {line}" for line in one.silent]
    return "\n".join(lines)


def code_of(asked: Sequence[Asked]) -> int:
    """The exit code."""
    if any(one.weak for one in asked):
        return 1
    return 2 if any(one.silent for one in asked) else 0


def main() -> int:
    """Ask, and print."""
    python = [sys.executable, "-m", "pip_audit", "--format", "json", "--progress-spinner", "off"]
    asked = [of_python(*_output([*python, "--skip-editable"], _ROOT))]
    npm = ["npm", "audit", "--omit=dev", "--package-lock-only", "--json"]
    asked += [of_npm(folder, *_output(npm, _ROOT / folder)) for folder in _NPM]
    print(report(asked))  # noqa: T201
    return code_of(asked)


def _output(command: list[str], folder: Path) -> tuple[str, str]:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return "", f"{command[0]} is not installed"
    return done.stdout, done.stderr


def _json(text: str) -> dict[str, Any] | None:
    try:
        found: dict[str, Any] = json.loads(text)
    except json.JSONDecodeError:
        return None
    return found


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "it said nothing"


if __name__ == "__main__":
    sys.exit(main())
