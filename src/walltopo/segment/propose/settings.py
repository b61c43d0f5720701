"""Settings of the `propose` stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class ProposeSettings:
    """Whether the mesh has a say in what is a hold (section `propose`)."""

    relief: Annotated[
        bool,
        about(
            "What stands out of the wall, and differs from it in colour, counts beside the masks; "
            "false: masks alone decide (docs/propose.md says when)"
        ),
    ] = False
    sure: Annotated[
        float,
        about(
            "Instances that the lift is so sure of keep their outline; below, what stands out of "
            "the wall there replaces it",
            low=0.0,
            high=1.0,
            expert=True,
        ),
    ] = 0.15
    listed: Annotated[
        float,
        about(
            "What stands out without any mask is kept, as doubtful, from this evidence on",
            low=0.0,
            high=1.0,
            expert=True,
        ),
    ] = 0.1
    seed: Annotated[int, about("seed of the search for panels", low=0, expert=True)] = 0

    def __post_init__(self) -> None:
        check_settings(self, "propose")
