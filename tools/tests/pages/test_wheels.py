"""A newcomer in an empty environment: the commands of the tutorials, word for word, and the rest.

The test types the pages' shell blocks (```sh) word for word, in one folder and in the pages' order.
The photos of the small gym replace the reader's own.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from numba import config
from tools.compiled_wheel import compiled_wheel

from walltopo.geometry.kernels import PROCESSOR

ROOT = Path(__file__).parents[3]
# Served until Ctrl-C: begun, waited for, stopped.
SERVED = re.compile(r"^walltopo view ")
# Coarse and small, so that it takes a minute rather than five.
SETTINGS = """\
[sparse]
threads = 1

[dense]
edge_length = 0.016

[texture]
size = 512

[export]
first_triangles = 20000
detail_triangles = 20000
"""

pytestmark = pytest.mark.slow


def blocks(page: str) -> list[str]:
    """The commands of a page, block by block."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(r"^```sh\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)


def clean_environment() -> dict[str, str]:
    """Nothing of the environment that the tests run in, but where pip finds packages."""
    kept = {name: text for name, text in os.environ.items() if name.startswith(("PIP_", "HOME"))}
    path = os.pathsep.join([str(Path(sys.executable).resolve().parent), "/usr/bin", "/bin"])
    pins = {"PIP_CONSTRAINT": str(ROOT / "constraints.txt"), "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    return {**kept, **pins, "PATH": path, "LANG": "C.UTF-8"}


def type_in(folder: Path, commands: str, venv: Path | None = None) -> str:
    """Run lines in a shell, which stops at the first that fails; what they said."""
    begin = f". {venv}/bin/activate\n" if venv else ""
    done = subprocess.run(
        ["bash", "-ec", begin + commands],
        cwd=folder,
        env=clean_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{commands}\n{done.stdout[-3000:]}{done.stderr[-3000:]}"
    return done.stdout + done.stderr


def answered(address: str, server: subprocess.Popen[str]) -> str:
    """The page at an address that a server, begun just now, will answer at."""
    while True:
        try:
            with urllib.request.urlopen(address) as answer:
                return str(answer.read().decode())
        except (ConnectionError, urllib.error.URLError):
            assert server.poll() is None, "the server ended"


def serve_and_stop(folder: Path, command: str, venv: Path) -> str:
    """Begin a server, look at its address, press Ctrl-C; what it said."""
    server = subprocess.Popen(
        ["bash", "-c", f". {venv}/bin/activate; exec {command}"],
        cwd=folder,
        text=True,
        env=clean_environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert server.stdout is not None
    shown = ""
    for line in server.stdout:
        shown += line
        if "http://" in line:
            break
    page = answered(re.findall(r"http://\S+", shown)[-1], server)
    assert "<wall-topo" in page, shown
    server.send_signal(signal.SIGINT)
    rest, _ = server.communicate(timeout=900)
    assert server.returncode == 0, shown + rest
    return shown


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the checkout, installed as the setter's page says: it leaves build/ behind."""
    copy = tmp_path_factory.mktemp("newcomer") / "walltopo"
    # Other tests write caches of compiled code meanwhile.
    caches = ("__pycache__", "*.pyc", "*.nb[ic]", "htmlcov")
    skipped = shutil.ignore_patterns(
        ".*",
        "node_modules",
        "build",
        "site",
        "dist",
        "*-scan",
        "demo-gym",
        "pictures",
        "results",
        *caches,
    )
    shutil.copytree(ROOT, copy, ignore=skipped, symlinks=True)
    output = type_in(copy, blocks("setter.md")[0])
    assert "A scan can run here" in output
    return copy


@pytest.fixture(scope="module")
def venv(checkout: Path) -> Path:
    return checkout / ".venv"


@pytest.fixture(scope="module")
def folder(checkout: Path, tiny_photos: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a working folder: photos of a wall, photos of it after a reset, and the examples."""
    room = tmp_path_factory.mktemp("work")
    shutil.copytree(tiny_photos, room / "photos")
    shutil.copytree(tiny_photos, room / "new-photos")
    (room / "walltopo.toml").write_text(SETTINGS)
    (room / "examples").symlink_to(checkout / "examples")
    return room


def test_the_setters_page(folder: Path, venv: Path) -> None:
    """From the printed sheet to the folder for the gym's web space, and the next reset."""
    typed = blocks("setter.md")[1:]
    assert len(typed) >= 7
    for block in typed:
        if SERVED.match(block):
            serve_and_stop(folder, block.strip(), venv)
        else:
            type_in(folder, block, venv)
    assert (folder / "plate.pdf").read_bytes().startswith(b"%PDF")
    assert (folder / "site" / "index.html").is_file()
    assert (folder / "left-wall.html").is_file()
    assert (folder / "wall-june" / "routes.json").is_file()


def test_the_translations_have_the_same_commands() -> None:
    theirs = [page.name for page in (ROOT / "docs").glob("setter.??.md")]
    assert len(theirs) == 3
    for page in theirs:
        assert blocks(page) == blocks("setter.md"), page


def test_the_researchers_page(folder: Path, venv: Path) -> None:
    """Twelve things on a table, from a COLMAP project, by the command and by the script."""
    output = [type_in(folder, block, venv) for block in blocks("researcher.md")]
    assert len(output) == 3
    assert "12 instances" in output[1]
    loss, *things = output[2].splitlines()
    assert "camera" in loss
    assert len(things) == 12
    assert (folder / "lifted" / "instances.glb").is_file()


def test_what_is_no_python_is_installed_too(folder: Path, venv: Path) -> None:
    inside = (
        "import walltopo.publish as e, walltopo, pathlib; root = pathlib.Path(e.__file__).parent; "
        "print(len(list(root.rglob('*.jinja'))), (root / 'page' / 'viewer.js').is_file(), "
        "len(list((root.parent / 'models').glob('*.onnx'))))"
    )
    templates, viewer, models = type_in(folder, f'python -c "{inside}"', venv).split()
    assert int(templates) >= 2
    assert viewer == "True"
    assert int(models) >= 2


def test_the_lab_and_the_platform_add_their_commands(checkout: Path, venv: Path) -> None:
    """Without the lab its commands tell what to install; with it they are there."""
    output = type_in(checkout, "walltopo synth x || test $? = 5", venv)
    assert "walltopo-lab" in output
    type_in(checkout, "pip install -q --no-deps ./lab", venv)
    assert "--preset" in type_in(checkout, "walltopo synth --help", venv)


COUNT = """
from numba.core import event
from walltopo.pipeline.warm_up import TABLE, compile_line

compiled = []

class Listener(event.Listener):
    def on_start(self, event):
        compiled.append(event.data["dispatcher"])

    def on_end(self, event):
        pass

event.register("numba:compile", Listener())
lines = TABLE.read_text().splitlines()
for line in lines:
    compile_line(line)
print(len(lines), len(compiled))
"""


@pytest.mark.skipif(config.CPU_NAME != PROCESSOR, reason="kernels for an older processor")
def test_a_wheel_that_carries_its_kernels(checkout: Path, venv: Path, tmp_path: Path) -> None:
    """Nothing is compiled where it is installed, though nothing was compiled there before."""
    type_in(checkout, f"pip wheel -q --no-deps -w '{tmp_path}' .", venv)
    (pure,) = tmp_path.glob("*.whl")
    carrying = compiled_wheel(pure)
    assert carrying.name.startswith(pure.name.removesuffix("-py3-none-any.whl"))
    # Also remove the kernels that earlier tests compiled there.
    package = type_in(tmp_path, "python -c 'import walltopo; print(*walltopo.__path__)'", venv)
    shutil.rmtree(package.strip())
    type_in(tmp_path, f"pip install -q --no-deps --force-reinstall '{carrying}'", venv)
    (tmp_path / "count.py").write_text(COUNT)
    kernels, compiled = type_in(tmp_path, "python count.py", venv).split()[-2:]
    assert int(kernels) > 50
    assert int(compiled) == 0
