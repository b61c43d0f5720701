"""The npm package of the viewer: packed, then used by a small consumer."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from test_viewer_browser import VIEWER, missing  # type: ignore[import-not-found]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing()), reason=f"npm package: {missing()}"),
]

CONSUMER = """\
import "wall-topo";
import type { Hold, Route, WallTopo } from "wall-topo";

const wall: WallTopo = document.createElement("wall-topo");
wall.setAttribute("loading", "lazy");
document.addEventListener("route-select", ({ detail }) => {
  const route: Route | null = detail.route;
  console.log(route?.holds.length);
});
wall.addEventListener("hold-select", ({ detail }) => {
  const hold: Hold = detail.hold;
  wall.selectRoute(hold.route, { move: true });
});
export const blob: Promise<Blob | null> = wall.picture();
"""
WRONG = """\
document.querySelector("wall-topo")?.selectRoute("three");
"""
CONFIG = {
    "compilerOptions": {
        "target": "ES2022",
        "module": "ESNext",
        "moduleResolution": "bundler",
        "lib": ["ES2022", "DOM", "DOM.Iterable"],
        "strict": True,
        "noEmit": True,
        "types": [],
    },
    "include": ["*.ts"],
}


def run(folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=600, check=False
    )


@pytest.fixture(scope="module")
def consumer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project that has the packed package installed, beside the libraries that it wants."""
    room = tmp_path_factory.mktemp("package")
    packed = run(VIEWER, "npm", "pack", "--silent", "--pack-destination", str(room))
    assert packed.returncode == 0, packed.stderr
    project = room / "consumer"
    modules = project / "node_modules"
    modules.mkdir(parents=True)
    # Python 3.11.2, which Debian 12 has, knows no filter yet.
    assert run(room, "tar", "-xzf", str(next(room.glob("*.tgz")))).returncode == 0
    (room / "package").rename(modules / "wall-topo")
    package = json.loads((modules / "wall-topo" / "package.json").read_text())
    for name in package["dependencies"]:
        (modules / name).symlink_to(VIEWER / "node_modules" / name)
    (project / "consumer.ts").write_text(CONSUMER)
    (project / "tsconfig.json").write_text(json.dumps(CONFIG))
    return project


def test_package_has_what_it_promises(consumer: Path) -> None:
    package = consumer / "node_modules" / "wall-topo"
    promised = json.loads((package / "package.json").read_text())
    entry = promised["exports"]["."]
    for name in (entry["types"], entry["default"], promised["exports"]["./viewer.js"]):
        assert (package / name).is_file(), name
    assert (package / "README.md").is_file()
    assert (package / "dist" / "LICENSE").is_file()
    assert promised["version"] == (VIEWER.parent / "VERSION").read_text().strip()
    module = (package / entry["default"]).read_text()
    assert 'from "three"' in module, "three.js is the consumer's own"
    assert not (package / "tests").exists()


def test_consumer_type_checks(consumer: Path) -> None:
    """Without skipLibCheck: the package's own declarations stand alone."""
    done = run(consumer, str(VIEWER / "node_modules" / ".bin" / "tsc"), "-p", ".")
    assert done.returncode == 0, done.stdout


def test_wrong_use_is_noticed(consumer: Path) -> None:
    wrong = consumer / "wrong.ts"
    wrong.write_text('import "wall-topo";\n' + WRONG)
    done = run(consumer, str(VIEWER / "node_modules" / ".bin" / "tsc"), "-p", ".")
    wrong.unlink()
    assert done.returncode != 0
    assert "wrong.ts(2," in done.stdout, done.stdout


def test_consumer_bundles(consumer: Path) -> None:
    """The module resolves, with the libraries from beside it."""
    (consumer / "index.html").write_text(
        '<!doctype html><script type="module" src="./consumer.ts"></script><wall-topo></wall-topo>'
    )
    done = run(
        consumer, str(VIEWER / "node_modules" / ".bin" / "vite"), "build", "--logLevel", "error"
    )
    assert done.returncode == 0, done.stderr
    assert any(b"wall-topo" in file.read_bytes() for file in (consumer / "dist").rglob("*.js"))
