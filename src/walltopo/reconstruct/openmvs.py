"""Find and run the OpenMVS programs, on a workspace of undistorted photos."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from walltopo.core import EnvironmentLacksError, Progress, StageError
from walltopo.core.children import child_process, ending

PROGRAMS = (
    "InterfaceCOLMAP",
    "DensifyPointCloud",
    "ReconstructMesh",
    "RefineMesh",
    "TextureMesh",
)

# Lines such as "Estimated depth-maps 12 (16.67%, 3s, ETA 15s)".
_PROGRESS = re.compile(r"(?P<what>[A-Za-z][A-Za-z\- ]*?) (?P<done>\d+) \((?P<percent>[\d.]+)%")

_TAIL_LINES = 12


@dataclass(frozen=True)
class Step:
    """One line of OpenMVS's progress."""

    what: str
    done: int
    percent: float


def find_programs(folder: str) -> dict[str, Path]:
    """Absolute paths of all programs, in `folder` or on PATH if it is empty.

    Raises
    ------
    EnvironmentLacksError : names each missing program and where it was looked for.
    """
    found = {name: shutil.which(name, path=folder or None) for name in PROGRAMS}
    missing = [name for name, path in found.items() if path is None]
    if missing:
        raise EnvironmentLacksError(
            f"OpenMVS: {', '.join(missing)} not found {f'in {folder}' if folder else 'on PATH'}",
            "Build OpenMVS (github.com/cdcseacave/openMVS) and set dense.openmvs_bin (or "
            "texture.openmvs_bin) to the folder of its programs, or use the embedded backends.",
        )
    return {name: Path(path).resolve() for name, path in found.items() if path is not None}


def parse_progress(line: str) -> Step | None:
    """The progress that a log line reports last, or None."""
    matches = list(_PROGRESS.finditer(line))
    if not matches:
        return None
    match = matches[-1]
    return Step(match["what"].strip(), int(match["done"]), float(match["percent"]))


def run_program(program: Path, arguments: Sequence[str], work: Path, progress: Progress) -> None:
    """Run one program in a folder, its progress passed on, its output kept in `<program>.log`.

    Parameters
    ----------
    program : absolute path.
    arguments : with absolute paths: a relative one is taken from `-w`, which is itself taken from
        the working folder.
    work : absolute path of the folder to run in.
    progress : told of the percents.

    Raises
    ------
    StageError : it ended with an error; with the last lines of its log.
    """
    name = program.name
    progress.step(f"OpenMVS {name}", 100)
    tail: list[str] = []
    shown = 0
    log = work / f"{name}.log"
    command = [str(program), *arguments, "-w", str(work)]
    with (
        log.open("w", encoding="utf-8") as stream,
        child_process(
            command, environment={"LC_ALL": "C"}, errors=subprocess.STDOUT, folder=work
        ) as child,
        # Universal newlines: OpenMVS rewrites its progress line with carriage returns.
        io.TextIOWrapper(child.output, errors="replace") as lines,
    ):
        for line in lines:
            stream.write(line)
            tail = [*tail, line.rstrip()][-_TAIL_LINES:]
            step = parse_progress(line)
            if step is None:
                continue
            if int(step.percent) < shown:
                progress.step(f"OpenMVS {name}: {step.what}", 100)
                shown = 0
            progress.advance(int(step.percent) - shown)
            shown = int(step.percent)
        code = child.wait()
    if code != 0:
        raise StageError(
            f"OpenMVS {name} ended with {ending(code)}:\n" + "\n".join(tail),
            f"The whole output is in {log}.",
        )


def undistorted_workspace(
    sparse: Path, photos: Path, work: Path, max_size: int, progress: Progress
) -> None:
    """Write `images/` and `sparse/` of pinhole cameras into `work`.

    Parameters
    ----------
    sparse, photos : the COLMAP model and the folder of its photos.
    work : an empty folder.
    max_size : longer side of the photos written, pixels; smaller ones keep their size.
    """
    from walltopo.geometry.colmap import pycolmap

    progress.step("undistorting photos")
    options = pycolmap.UndistortCameraOptions(max_image_size=max_size)
    level = pycolmap.logging.minloglevel
    # It reports every photo otherwise, into the middle of the progress shown.
    pycolmap.logging.minloglevel = pycolmap.logging.Level.WARNING.value
    try:
        pycolmap.undistort_images(work, sparse, photos, undistort_options=options)
    finally:
        pycolmap.logging.minloglevel = level


def import_scene(program: Path, work: Path, progress: Progress) -> Path:
    """OpenMVS's scene file, made from an undistorted workspace by InterfaceCOLMAP.

    Parameters
    ----------
    program : path of InterfaceCOLMAP.
    work : absolute path of the workspace.
    """
    scene = work / "scene.mvs"
    folders = ["-i", str(work), "--image-folder", str(work / "images")]
    run_program(program, [*folders, "-o", str(scene)], work, progress)
    return scene
