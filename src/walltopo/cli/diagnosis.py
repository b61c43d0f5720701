"""`walltopo doctor`: check this machine for everything that walltopo can use."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

from walltopo.core.files import shipped_file
from walltopo.core.memory import total_memory
from walltopo.core.parallel import available_cores
from walltopo.reconstruct.openmvs import PROGRAMS


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    Parameters
    ----------
    topic : the thing checked.
    state : "ok", "missing" (optional) or "problem" (a scan will not work well).
    detail : the result and its meaning.
    install : the command that fixes it; empty if nothing needs fixing.
    """

    topic: str
    state: str
    detail: str
    install: str = ""


_CORE = ("numpy", "scipy", "numba", "pycolmap", "cv2", "PIL", "pillow_heif", "av")
_CORE_MORE = ("networkit", "trimesh", "embreex", "potpourri3d", "fast_simplification")
_RUNTIME = ("faster_coco_eval", "jinja2", "msgspec", "onnxruntime", "rich", "segno", "shtab")
# Extras of this distribution: module and purpose.
_EXTRAS = {
    "web": ("meshoptimizer", "small pages"),
    "ray": ("ray", "many machines: `batch --ray`"),
    "s3": ("obstore", "photos and scans of `batch` in an object store"),
    "features": ("walltopo_features", "photos that all other features leave out"),
    "profile": ("viztracer", "`scan --profile`"),
}
# Other distributions add findings by entry points of this group.
_ENTRY_POINTS = "walltopo.doctor"
# Other distributions: module, and the commands it adds.
_BESIDE = {
    "walltopo-climb": ("walltopo_climb", "moves, grade, problem, ease"),
    "walltopo-lab": ("walltopo_lab", "synth, dataset, train, evaluate, tune"),
    "walltopo-gym": ("walltopo_gym", "a gym's walls online"),
}
# Programs that no scan needs: alternative names, purpose, Debian package.
_OTHERS = {
    "Chromium": (("chromium", "chromium-browser", "google-chrome"), "tests of pages", "chromium"),
    "node": (("node",), "building the viewer and the gym's app", "nodejs npm"),
    "C++ compiler": (("c++", "g++", "clang++"), "building the extra web", "g++ python3-dev"),
}


def examine(folder: Path) -> Iterator[Finding]:
    """Yield the findings about this machine, with the disk of `folder`."""
    yield Finding("python", "ok", sys.version.split()[0])
    yield from _packages()
    yield from _cores_and_memory()
    yield from _disk(folder)
    yield from _formats()
    yield from _accelerators()
    yield from _programs()
    yield from _models()
    yield from _distributions()


def _packages() -> Iterator[Finding]:
    missing = [n for n in (*_CORE, *_CORE_MORE, *_RUNTIME) if not importlib.util.find_spec(n)]
    if missing:
        text = f"missing: {', '.join(missing)}"
        yield Finding("packages", "problem", text, "pip install --force-reinstall walltopo")
    else:
        from walltopo.geometry.colmap import pycolmap

        text = f"all that a scan needs; COLMAP {pycolmap.__version__}"
        yield Finding("packages", "ok", text)
    for extra, (module, use) in _EXTRAS.items():
        if importlib.util.find_spec(module):
            yield Finding(f"extra {extra}", "ok", use)
        else:
            mend = f"pip install 'walltopo[{extra}]'"
            yield Finding(f"extra {extra}", "missing", f"for {use}", mend)


def _formats() -> Iterator[Finding]:
    """Check the decoder of iPhone photos (HEIC), which some wheels lack."""
    if not importlib.util.find_spec("pillow_heif"):
        return
    import pillow_heif

    able = bool(pillow_heif.libheif_info()["decoders"])
    detail = "iPhone photos can be read" if able else "this build of pillow-heif has no decoder"
    mend = "" if able else "pip install --force-reinstall pillow-heif"
    yield Finding("HEIC", "ok" if able else "problem", detail, mend)


def _distributions() -> Iterator[Finding]:
    for name, (module, adds) in _BESIDE.items():
        if importlib.util.find_spec(module) is None:
            yield Finding(name, "missing", f"adds {adds}", f"pip install {name}")
    if importlib.util.find_spec("walltopo_gym"):
        yield Finding("walltopo-gym", "ok", "`walltopo gym doctor --data DIR` checks a gym")
    for point in entry_points(group=_ENTRY_POINTS):
        yield from point.load()()


def _cores_and_memory() -> Iterator[Finding]:
    yield Finding("cores", "ok", str(available_cores()))
    total = total_memory() / 2**30
    state = "ok" if total >= 6 else "problem"
    advice = "" if total >= 6 else "; a scan of 70 photos needs 6"
    yield Finding("memory", state, f"{total:.1f} GiB{advice}")


def _disk(folder: Path) -> Iterator[Finding]:
    free = shutil.disk_usage(folder).free / 2**30
    state = "ok" if free >= 2 else "problem"
    yield Finding("disk", state, f"{free:.1f} GiB free at {folder.absolute()}")


def _accelerators() -> Iterator[Finding]:
    """Check GPU support: both libraries come without CUDA, and alternatives support a device."""
    device = Path("/proc/driver/nvidia/version").is_file() or shutil.which("nvidia-smi") is not None
    if not device:
        yield Finding("GPU", "missing", "no NVIDIA device; optional, everything runs on the CPU")
        return
    if importlib.util.find_spec("pycolmap"):
        from walltopo.reconstruct.dense.colmap import has_cuda

        yield _for_gpu(
            "COLMAP", has_cuda(), "dense backend `colmap`", "pycolmap", "pycolmap-cuda12"
        )
    if importlib.util.find_spec("onnxruntime"):
        from walltopo.images.networks import runs_on_gpu

        able = runs_on_gpu("auto")
        yield _for_gpu("detection", able, "detection", "onnxruntime", "onnxruntime-gpu")


def _for_gpu(topic: str, able: bool, what: str, plain: str, other: str) -> Finding:
    if able:
        return Finding(f"GPU, {topic}", "ok", f"{what} runs on it")
    line = f"pip uninstall -y {plain} && pip install {other}"
    return Finding(f"GPU, {topic}", "missing", f"{what} runs on the CPU", line)


def _programs() -> Iterator[Finding]:
    absent = [name for name in PROGRAMS if shutil.which(name) is None]
    if absent:
        reason = f"optional dense backend, built from source; not on PATH: {', '.join(absent)}"
        yield Finding("OpenMVS", "missing", reason)
    else:
        yield Finding("OpenMVS", "ok", "`openmvs` available to dense and texture")
    for topic, (names, use, package) in _OTHERS.items():
        found = next((path for path in map(shutil.which, names) if path), None)
        mend = f"sudo apt-get install {package}" if not found and shutil.which("apt-get") else ""
        yield Finding(topic, "ok" if found else "missing", found or f"only for {use}", mend)


def _models() -> Iterator[Finding]:
    folder = shipped_file("holds.onnx").parent
    found = sorted(path.name for path in folder.glob("*.onnx"))
    if found:
        yield Finding("models", "ok", ", ".join(found))
    else:
        mend = "pip install --force-reinstall walltopo"
        yield Finding("models", "problem", "no detector is installed", mend)
