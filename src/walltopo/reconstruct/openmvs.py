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
from walltopo.core.children import child_process, describe_exit

PROGRAMS = (
    "InterfaceCOLMAP",
    "DensifyPointCloud",
    "ReconstructMesh",
    "RefineMesh",
    "TextureMesh",
)

# Lines such as "Estimated depth-maps 12 (16.67%, 3s, ETA 15s)".
_PROGRESS = re.compile(r"(?P<task>[A-Za-z][A-Za-z\- ]*?) (?P<done>\d+) \((?P<percent>[\d.]+)%")

_TAIL_LINES = 12


@dataclass(frozen=True)
class ProgressLine:
    """One progress report of an OpenMVS program: task, items done and percentage."""

    task: str
    done: int
    percent: float


def find_programs(folder: str) -> dict[str, Path]:
    """Return the absolute path of each program, found in `folder`, or on PATH if it is empty.

    Raises
    ------
    EnvironmentLacksError : a program is missing; the message names each and the folder searched.
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


def parse_progress(line: str) -> ProgressLine | None:
    """Return the last progress that a log line reports, or None."""
    matches = list(_PROGRESS.finditer(line))
    if not matches:
        return None
    match = matches[-1]
    return ProgressLine(match["task"].strip(), int(match["done"]), float(match["percent"]))


def run_program(program: Path, arguments: Sequence[str], work: Path, progress: Progress) -> None:
    """Run one program in a folder, report its progress and keep its output in `<program>.log`.

    Parameters
    ----------
    program : absolute path.
    arguments : use absolute paths; OpenMVS resolves relative ones against its `-w` folder.
    work : absolute path of the folder to run in.
    progress : receives the percentage.

    Raises
    ------
    StageError : the program failed; the message holds the last lines of its log.
    """
    name = program.name
    progress.step(f"OpenMVS {name}", 100)
    tail: list[str] = []
    reported = 0
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
            if int(step.percent) < reported:
                progress.step(f"OpenMVS {name}: {step.task}", 100)
                reported = 0
            progress.advance(int(step.percent) - reported)
            reported = int(step.percent)
        code = child.wait()
    if code != 0:
        raise StageError(
            f"OpenMVS {name} ended with {describe_exit(code)}:\n" + "\n".join(tail),
            f"The whole output is in {log}.",
        )


def write_undistorted_workspace(
    sparse: Path, photos: Path, work: Path, max_size: int, progress: Progress
) -> None:
    """Write undistorted `images/` and a `sparse/` model of pinhole cameras into `work`.

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
    # pycolmap logs every photo at INFO, which would break the progress display.
    pycolmap.logging.minloglevel = pycolmap.logging.Level.WARNING.value
    try:
        pycolmap.undistort_images(work, sparse, photos, undistort_options=options)
    finally:
        pycolmap.logging.minloglevel = level


def import_scene(program: Path, work: Path, progress: Progress) -> Path:
    """Convert an undistorted workspace with InterfaceCOLMAP; return the path of OpenMVS's scene
    file.

    Parameters
    ----------
    program : path of InterfaceCOLMAP.
    work : absolute path of the workspace.
    """
    scene = work / "scene.mvs"
    folders = ["-i", str(work), "--image-folder", str(work / "images")]
    run_program(program, [*folders, "-o", str(scene)], work, progress)
    return scene
