"""List the stages of a scan in order; each module defines one stage (`walltopo.pipeline.plan`
says which of them a scan has).

Heavy libraries are imported when a stage runs, so importing this package is fast.
"""

from __future__ import annotations

from walltopo.core import InputError
from walltopo.pipeline.stage import Stage
from walltopo.pipeline.stages.classify import CLASSIFY
from walltopo.pipeline.stages.dense import DENSE
from walltopo.pipeline.stages.detect import DETECT
from walltopo.pipeline.stages.edit import EDIT
from walltopo.pipeline.stages.export import EXPORT
from walltopo.pipeline.stages.ingest import INGEST
from walltopo.pipeline.stages.join import JOIN
from walltopo.pipeline.stages.lift import LIFT
from walltopo.pipeline.stages.propose import PROPOSE
from walltopo.pipeline.stages.routes import ROUTES
from walltopo.pipeline.stages.scale import SCALE
from walltopo.pipeline.stages.sparse import SPARSE
from walltopo.pipeline.stages.texture import TEXTURE

STAGES = (
    INGEST,
    SPARSE,
    SCALE,
    DENSE,
    TEXTURE,
    DETECT,
    LIFT,
    PROPOSE,
    CLASSIFY,
    ROUTES,
    JOIN,
    EDIT,
    EXPORT,
)


def stage_names() -> tuple[str, ...]:
    """Return the stages' names, in order."""
    return tuple(stage.name for stage in STAGES)


def stage_index(name: str) -> int:
    """Return the position of a stage.

    Raises
    ------
    InputError : unknown stage; the message lists the stages.
    """
    if name not in stage_names():
        raise InputError(f"unknown stage {name!r}; the stages are {', '.join(stage_names())}")
    return stage_names().index(name)


def stage_named(name: str) -> Stage:
    """Return the stage of a name; raise InputError as `stage_index`."""
    return STAGES[stage_index(name)]
