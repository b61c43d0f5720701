"""The `openmvs` backend: drives the OpenMVS programs.

Command lines after OpenMVS 2's own pipeline script (MvgMvsPipeline.py) and its wiki, "Usage":
InterfaceCOLMAP on an undistorted COLMAP workspace, DensifyPointCloud, ReconstructMesh, RefineMesh.
TextureMesh is not used: walltopo textures the cleaned mesh itself.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from walltopo.core import EnvironmentLacksError, Mesh, Progress, StageError
from walltopo.dense.contract import DenseSettings
from walltopo.dense.remesh import finish
from walltopo.dense.undistorted import undistorted_workspace
from walltopo.meshes.ply import read_mesh

__all__ = ["PROGRAMS", "commands", "find_programs", "openmvs_mesh", "parse_progress", "run_program"]

PROGRAMS = ("InterfaceCOLMAP", "DensifyPointCloud", "ReconstructMesh", "RefineMesh")
# Lines such as "Estimated depth-maps 12 (16.67%, 3s, ETA 15s)".
_PROGRESS = re.compile(r"(?P<what>[A-Za-z][A-Za-z\- ]*?) (?P<done>\d+) \((?P<percent>[\d.]+)%")
_TAIL_LINES = 12


@dataclass(frozen=True)
class Step:
    """One line of OpenMVS's progress."""

    what: str
    done: int
    percent: float


def find_programs(folder: str) -> dict[str, str]:
    """Paths of the programs, in `folder` or on PATH if it is empty.

    Raises
    ------
    EnvironmentLacksError : names each missing program and where it was looked for.
    """
    where = folder or None
    found = {name: shutil.which(name, path=where) for name in PROGRAMS}
    missing = [name for name, path in found.items() if path is None]
    if missing:
        raise EnvironmentLacksError(
            f"OpenMVS: {', '.join(missing)} not found {f'in {folder}' if folder else 'on PATH'}",
            "Build OpenMVS (github.com/cdcseacave/openMVS) and set dense.openmvs_bin to the "
            "folder of its programs, or use dense.backend = sgm.",
        )
    return {name: path for name, path in found.items() if path is not None}


def commands(programs: dict[str, str], work: Path, max_size: int) -> list[list[str]]:
    """Argument lists of the steps, in order.

    Parameters
    ----------
    programs : from `find_programs`.
    work : an undistorted COLMAP workspace (`images/`, `sparse/`); results are written there.
    max_size : longer side of the photos that stereo sees, pixels.
    """
    steps = {
        "InterfaceCOLMAP": "-i . -o scene.mvs --image-folder images",
        "DensifyPointCloud": "scene.mvs -o scene_dense.mvs --resolution-level 0 "
        f"--max-resolution {max_size}",
        "ReconstructMesh": "scene_dense.mvs -p scene_dense.ply -o scene_mesh.ply",
        "RefineMesh": "scene_dense.mvs -m scene_mesh.ply -o scene_refined.ply",
    }
    return [
        [programs[name], *arguments.split(), "-w", str(work)] for name, arguments in steps.items()
    ]


def parse_progress(line: str) -> Step | None:
    """The progress that a log line reports, or None."""
    match = _PROGRESS.search(line)
    if match is None:
        return None
    return Step(match["what"].strip(), int(match["done"]), float(match["percent"]))


def run_program(command: Sequence[str], work: Path, progress: Progress) -> None:
    """Run one program, its progress passed on, its output kept in `<program>.log`.

    Raises
    ------
    StageError : it ended with an error; with the last lines of its log.
    """
    name = Path(command[0]).name
    progress.step(f"OpenMVS {name}", 100)
    tail: list[str] = []
    shown = 0
    log = work / f"{name}.log"
    with (
        log.open("w", encoding="utf-8") as stream,
        subprocess.Popen(
            command,
            cwd=work,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env={**os.environ, "LC_ALL": "C"},
        ) as process,
    ):
        assert process.stdout is not None
        # Universal newlines: OpenMVS rewrites its progress line with carriage returns.
        for line in process.stdout:
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
        code = process.wait()
    if code != 0:
        raise StageError(
            f"OpenMVS {name} ended with code {code}:\n" + "\n".join(tail),
            f"The whole output is in {log}.",
        )


def openmvs_mesh(
    sparse: Path,
    photos: Path,
    work: Path,
    settings: DenseSettings,
    edge: float,
    unit: float,
    progress: Progress,
) -> Mesh:
    """A clean mesh by OpenMVS; parameters as in `colmap.colmap_mesh`.

    Raises
    ------
    EnvironmentLacksError : a program is missing.
    StageError : a program failed or wrote no mesh.
    """
    programs = find_programs(settings.openmvs_bin)
    undistorted_workspace(sparse, photos, work, settings.max_size, progress)
    for command in commands(programs, work, settings.max_size):
        run_program(command, work, progress)
    result = work / "scene_refined.ply"
    if not result.is_file():
        raise StageError(f"OpenMVS wrote no mesh at {result}", f"Its logs (*.log) are in {work}.")
    return finish(read_mesh(result), settings, edge, unit)
