"""`python -m tools.audit` (`make audit`): report known vulnerabilities of the dependencies.

pip-audit checks the installed Python packages against PyPI. npm checks the packages that the two
lock files pin. A package that could not be checked is listed and does not pass: the exit code is 1
for a known vulnerability, 2 for an unchecked package, 0 otherwise.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

_ROOT: Final = Path(__file__).resolve().parents[1]
_NPM: Final = ("viewer", "gym/web")
# Our own packages, installed from this checkout: no registry lists them.
_OWN: Final = ("walltopo", "walltopo-features", "walltopo-climb", "walltopo-lab", "walltopo-gym")


@dataclass(frozen=True)
class Checked:
    """The findings of one package registry.

    Parameters
    ----------
    where : name of the registry and of the checked set of packages.
    packages : number of packages checked.
    weak : one line per known vulnerability.
    silent : one line per package that was not checked, with the reason.
    """

    where: str
    packages: int = 0
    weak: tuple[str, ...] = ()
    silent: tuple[str, ...] = ()


def of_python(json_text: str, failed: str) -> Checked:
    """Return the findings of pip-audit.

    Parameters
    ----------
    json_text : pip-audit's JSON output; failed : its error output, the reason if there is no JSON.
    """
    where = "PyPI, what is installed here"
    found = _json(json_text)
    if found is None:
        return Checked(where, silent=(f"everything: {_last_line(failed)}",))
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
    return Checked(where, packages, tuple(weak), tuple(silent))


def of_npm(folder: str, json_text: str, failed: str) -> Checked:
    """Return the findings of `npm audit` in a folder; parameters as in `of_python`."""
    where = f"npm, what {folder} ships"
    found = _json(json_text)
    if found is None or "vulnerabilities" not in found:
        why = (found or {}).get("message") or _last_line(failed)
        return Checked(where, silent=(f"everything: {why}",))
    weak = [
        f"{name} {row['range']}: {row['severity']}"
        for name, row in found["vulnerabilities"].items()
    ]
    return Checked(where, found["metadata"]["dependencies"]["prod"], tuple(weak))


def report(results: Sequence[Checked]) -> str:
    """Return the findings of all registries as text."""
    lines = []
    for one in results:
        known = f"{len(one.weak)} known weaknesses" if one.weak else "no known weakness"
        lines.append(f"{one.where}: {one.packages} packages asked about, {known}")
        lines += [f"  {line}" for line in one.weak]
        if one.silent:
            lines.append(f"{one.where}: NOT ASKED about {len(one.silent)}")
            lines += [f"  {line}" for line in one.silent]
    return "\n".join(lines)


def code_of(results: Sequence[Checked]) -> int:
    """Return the exit code: 1 for a vulnerability, 2 for an unchecked package, else 0."""
    if any(one.weak for one in results):
        return 1
    return 2 if any(one.silent for one in results) else 0


def main() -> int:
    """Check the Python and npm packages, print the report and return the exit code."""
    python = [sys.executable, "-m", "pip_audit", "--format", "json", "--progress-spinner", "off"]
    results = [of_python(*_output([*python, "--skip-editable"], _ROOT))]
    npm = ["npm", "audit", "--omit=dev", "--package-lock-only", "--json"]
    results += [of_npm(folder, *_output(npm, _ROOT / folder)) for folder in _NPM]
    print(report(results))  # noqa: T201
    return code_of(results)


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
