"""All cameras at once, by COLMAP's global mapping: part of the child process that calls COLMAP.

First the rotations of all photos, then where all cameras and points are, then one adjustment of
all together: its time does not grow with the number of adjustments as that of the incremental
mapping does, which goes through all of them again and again while it takes in photo after photo.

Source: Pan, Barath, Pollefeys & Schoenberger, "Global Structure-from-Motion Revisited" (ECCV 2024).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from walltopo.sparse.job import Job, MapTask

__all__ = ["map_at_once"]


def map_at_once(database: Path, job: Job, task: MapTask) -> dict[int, Any]:
    """`pycolmap.Reconstruction` by number; also written to folders of these numbers."""
    from walltopo.colmap import pycolmap

    options = pycolmap.GlobalPipelineOptions()
    # One thread and one seed: a resumed scan ends with the same model (see the incremental way).
    options.num_threads = 1
    options.random_seed = job.seed
    options.min_num_matches = job.min_matches
    options.min_model_size = 3
    options.image_names = list(task.only)
    mapper = options.mapper
    mapper.num_threads = 1
    mapper.random_seed = job.seed
    mapper.rotation_averaging.random_seed = job.seed
    mapper.global_positioning.random_seed = job.seed
    mapper.retriangulation.random_seed = job.seed
    mapper.global_positioning.use_gpu = False
    mapper.bundle_adjustment.ceres.use_gpu = False
    mapper.bundle_adjustment.ceres.solver_options.num_threads = 1
    return dict(pycolmap.global_mapping(database, job.image_root, task.output, options))
