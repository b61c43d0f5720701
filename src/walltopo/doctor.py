"""What this machine can do: programs, accelerators, models, memory, disk."""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

from walltopo.openmvs.programs import PROGRAMS

__all__ = ["Finding", "examine"]


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    Parameters
    ----------
    topic : what was looked at.
    state : "ok", "missing" (optional things) or "problem" (a scan will not work well).
    detail : what was found and what it means.
    """

    topic: str
    state: str
    detail: str


_CORE = ("numpy", "scipy", "numba", "pycolmap", "cv2", "PIL", "pillow_heif", "av")
_CORE_MORE = ("networkit", "trimesh", "embreex", "potpourri3d", "fast_simplification")
_RUNTIME = ("faster_coco_eval", "jinja2", "msgspec", "onnxruntime", "rich", "segno", "shtab")
# Other distributions report on themselves by entry points of this group.
_ENTRY_POINTS = "walltopo.doctor"
_LAB = "not installed (optional): adds synth, dataset, train, evaluate, tune"


def examine(folder: Path) -> Iterator[Finding]:
    """Look at the machine; `folder` tells which disk is meant."""
    yield Finding("python", "ok", sys.version.split()[0])
    yield from _packages()
    yield from _cores_and_memory()
    yield from _disk(folder)
    yield from _accelerators()
    yield from _programs()
    yield from _models()
    yield from _distributions()


def _packages() -> Iterator[Finding]:
    missing = [n for n in (*_CORE, *_CORE_MORE, *_RUNTIME) if not importlib.util.find_spec(n)]
    if missing:
        yield Finding("packages", "problem", f"missing: {', '.join(missing)}; reinstall walltopo")
    else:
        yield Finding("packages", "ok", "all that the core needs")
    absent = importlib.util.find_spec("meshoptimizer") is None
    detail = "pip install 'walltopo[web]' (a C++ compiler builds it): smaller pages"
    yield Finding("extra web", "missing" if absent else "ok", detail if absent else "installed")


def _distributions() -> Iterator[Finding]:
    points = entry_points(group=_ENTRY_POINTS)
    if "walltopo-lab" not in points.names:
        yield Finding("walltopo-lab", "missing", _LAB)
    for point in points:
        yield from point.load()()


def _cores_and_memory() -> Iterator[Finding]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    yield Finding("cores", "ok", str(cores))
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    state = "ok" if total >= 6 else "problem"
    advice = "" if total >= 6 else "; a scan of 70 photos wants 6"
    yield Finding("memory", state, f"{total:.1f} GiB{advice}")


def _disk(folder: Path) -> Iterator[Finding]:
    free = shutil.disk_usage(folder).free / 2**30
    state = "ok" if free >= 2 else "problem"
    yield Finding("disk", state, f"{free:.1f} GiB free at {folder.absolute()}")


def _accelerators() -> Iterator[Finding]:
    if importlib.util.find_spec("pycolmap"):
        from walltopo.dense.colmap import has_cuda

        cuda = has_cuda()
        detail = "dense backend `colmap` available" if cuda else "none, or no device for it"
        yield Finding("pycolmap CUDA", "ok" if cuda else "missing", detail)
    if importlib.util.find_spec("onnxruntime"):
        import onnxruntime

        cuda = "CUDAExecutionProvider" in onnxruntime.get_available_providers()
        detail = "detection runs on the GPU" if cuda else "CPU only: detection runs on the CPU"
        yield Finding("onnxruntime CUDA", "ok" if cuda else "missing", detail)


def _programs() -> Iterator[Finding]:
    absent = [name for name in PROGRAMS if shutil.which(name) is None]
    if absent:
        yield Finding("OpenMVS", "missing", f"not on PATH: {', '.join(absent)} (optional)")
    else:
        yield Finding("OpenMVS", "ok", "`openmvs` available to dense and texture")
    ffmpeg = shutil.which("ffmpeg")
    detail = ffmpeg or "not on PATH; not needed, videos are read by PyAV's own"
    yield Finding("ffmpeg", "ok" if ffmpeg else "missing", detail)


def _models() -> Iterator[Finding]:
    folder = Path(__file__).parent / "models"
    found = sorted(path.name for path in folder.glob("*.onnx"))
    if found:
        yield Finding("models", "ok", ", ".join(found))
    else:
        yield Finding("models", "problem", "no detector is installed; reinstall walltopo")
