"""Install a release's wheels and source archives into empty environments and use them.

    python -m tools.release_check DIST PYTHON [PYTHON ...]

DIST is what `make wheels` fills. Our packages come from DIST alone, their dependencies from pip's
index at the versions of `constraints.txt`. A Python that is not installed is skipped with a line.
The checksums of DIST are signed with a throw-away key and verified, before and after a change.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rich.console import Console

ROOT: Final = Path(__file__).parents[1]
UNITS: Final = ("walltopo", "walltopo-features", "walltopo-climb", "walltopo-lab", "walltopo-gym")
MODULES: Final = tuple(unit.replace("-", "_") for unit in UNITS)
NAMESPACE: Final = "walltopo"  # of signatures, for `ssh-keygen -Y`
# Commands of the five units in an empty folder; each must succeed.
SMOKE: Final = (
    "python -c 'import walltopo, walltopo_features, walltopo_climb, walltopo_lab, walltopo_gym'",
    "walltopo doctor",
    "walltopo measure print -o plate.pdf",
    "walltopo grade --help",
    "walltopo synth --help",
    "walltopo gym migrate --data gym",
    "walltopo gym doctor --data gym",
)


console = Console(highlight=False, soft_wrap=True)


def run(command: Sequence[str | Path], folder: Path, path: Path | None = None) -> str:
    """Run a command without this environment's Python path; return its output.

    Parameters
    ----------
    path : folder of programs that are found first.

    Raises
    ------
    SystemExit : the command fails.
    """
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    environment["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"
    if path is not None:
        environment["PATH"] = f"{path}{os.pathsep}{environment['PATH']}"
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        words = " ".join(map(str, command))
        raise SystemExit(f"{words}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def check_wheels(dist: Path, python: str, version: str, folder: Path) -> None:
    """Install all units and their dependencies into an empty environment, and use each."""
    began = time.monotonic()
    programs = _environment(python, folder / "wheels")
    wanted = [f"{unit}=={version}" for unit in UNITS]
    pip: list[str | Path] = [programs / "python", "-m", "pip", "install", "--quiet"]
    run([*pip, "--no-index", "--no-deps", "--find-links", dist, *wanted], folder)
    run([*pip, "--constraint", ROOT / "constraints.txt", *wanted], folder)
    run([programs / "python", "-m", "pip", "check"], folder)
    room = folder / "room"
    room.mkdir()
    shown = run(["walltopo", "--version"], room, programs).strip()
    if shown != f"walltopo {version}":
        raise SystemExit(f"walltopo --version: {shown}, expected walltopo {version}")
    for line in SMOKE:
        run(["bash", "-c", line], room, programs)
    size = sum(file.stat().st_size for file in programs.parent.rglob("*") if file.is_file())
    took = time.monotonic() - began
    console.print(f"{python}: 4 wheels installed and used in {took:.0f} s, {size / 1e6:.0f} MB")


def check_sources(dist: Path, python: str, version: str, folder: Path) -> None:
    """Install each source archive; its files must be those of the wheel."""
    programs = _environment(python, folder / "sources")
    pip: list[str | Path] = [programs / "python", "-m", "pip", "install", "--quiet"]
    run([*pip, "--upgrade", "setuptools"], folder)
    apart = ["--no-index", "--no-deps", "--no-build-isolation", "--no-binary", ":all:"]
    run([*pip, *apart, "--find-links", dist, *(f"{u}=={version}" for u in UNITS)], folder)
    (site,) = programs.parent.glob("lib/python*/site-packages")
    for module in MODULES:
        with zipfile.ZipFile(dist / f"{module}-{version}-py3-none-any.whl") as wheel:
            packed = {name for name in wheel.namelist() if name.startswith(f"{module}/")}
        found = (file for file in (site / module).rglob("*") if file.is_file())
        installed = {str(f.relative_to(site)) for f in found if f.suffix != ".pyc"}
        if packed != installed:
            other = sorted(packed ^ installed)[:10]
            raise SystemExit(f"{module}: source archive and wheel differ in {', '.join(other)}")
        console.print(
            f"{python}: {module}: source archive and wheel have the same {len(packed)} files"
        )


def _environment(python: str, folder: Path) -> Path:
    """Create an empty environment; return the folder of its programs."""
    run([python, "-m", "venv", folder], folder.parent)
    return folder / "bin"


def check_signature(sums: Path, folder: Path) -> None:
    """Sign the checksums with a throw-away key; the signature must hold, and only for them."""
    key, copy = folder / "key", folder / sums.name
    shutil.copyfile(sums, copy)
    run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-C", "try", "-f", key], folder)
    run(["ssh-keygen", "-q", "-Y", "sign", "-n", NAMESPACE, "-f", key, copy], folder)
    public = key.with_suffix(".pub").read_text(encoding="utf-8")
    (folder / "signers").write_text(f"maintainers {public}", encoding="utf-8")
    run(["bash", "-c", verify_line(copy.name)], folder)
    copy.write_text(copy.read_text(encoding="utf-8").replace("0", "1", 1), encoding="utf-8")
    changed = subprocess.run(
        ["bash", "-c", verify_line(copy.name)], cwd=folder, capture_output=True, check=False
    )
    if changed.returncode == 0:
        raise SystemExit(f"the signature of {sums} also holds for changed checksums")
    console.print(f"{sums.name}: a signature holds, and fails after a change")


def verify_line(sums: str) -> str:
    """Return the command that verifies the signature of checksums against a file `signers`."""
    return f"ssh-keygen -Y verify -f signers -I maintainers -n {NAMESPACE} -s {sums}.sig < {sums}"


def _works(python: str) -> bool:
    try:
        done = subprocess.run([python, "-c", ""], capture_output=True, check=False)
    except OSError:
        return False
    return done.returncode == 0


def main() -> int:
    """Check a folder of packages; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("dist", type=Path, metavar="DIST")
    parser.add_argument("pythons", nargs="+", metavar="PYTHON", help="programs, e.g. python3.12")
    args = parser.parse_args()
    dist, version = args.dist.absolute(), (ROOT / "VERSION").read_text(encoding="utf-8").strip()
    there = [python for python in args.pythons if _works(python)]
    for python in sorted({*args.pythons} - {*there}):
        console.print(f"{python}: not installed here; nothing was tried on it")
    if not there:
        raise SystemExit("none of these Pythons is installed here")
    for number, python in enumerate(there):
        with tempfile.TemporaryDirectory() as folder:
            if number == 0:
                check_sources(dist, python, version, Path(folder))
            check_wheels(dist, python, version, Path(folder))
    with tempfile.TemporaryDirectory() as folder:
        check_signature(dist / "SHA256SUMS", Path(folder))
    for file in sorted(dist.iterdir()):
        console.print(f"{file.stat().st_size / 1e6:8.2f} MB  {file.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
