"""Settings of the `routes` stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import SettingsError, about, check_settings


@dataclass(frozen=True)
class RoutesSettings:
    """How holds of one colour are grouped into routes (section `routes`)."""

    min_hold_dist: Annotated[
        float,
        about(
            "colour: holds nearer than this along the wall are fully similar",
            unit="m",
            low=0,
            high=5,
        ),
    ] = 0.6
    max_hold_dist: Annotated[
        float,
        about(
            "colour: holds farther than this along the wall are not linked",
            unit="m",
            low=0,
            high=10,
        ),
    ] = 1.6
    flatten_ratio: Annotated[
        float,
        about(
            "colour: the vertical part of a path counts by this factor (routes go up)",
            low=0,
            high=1,
            expert=True,
        ),
    ] = 0.2
    resolution: Annotated[
        float,
        about("colour: resolution of Louvain, larger gives more, smaller routes", low=0, high=100),
    ] = 0.5
    link: Annotated[
        Literal["colour", "paint"],
        about(
            "paint: holds are linked by how alike their paint is and how near they are; colour: "
            "holds of one colour name by how near they are (see docs/routes.md)"
        ),
    ] = "paint"
    min_holds: Annotated[
        int, about("Groups with fewer holds are left without a route", low=1, high=50)
    ] = 2
    bridge_gap: Annotated[
        float,
        about(
            "Parts of the wall that end this near each other count as joined",
            unit="m",
            low=0,
            high=5,
            expert=True,
        ),
    ] = 0.5
    ambiguous_above: Annotated[
        float,
        about(
            "A second route with at least this probability makes a hold ambiguous",
            low=0,
            high=0.5,
            expert=True,
        ),
    ] = 0.3
    threads: Annotated[
        int,
        about("Worker threads for the paths; 0: as many as cores", low=0, high=256, expert=True),
    ] = 0
    seed: Annotated[int, about("Seed of Louvain", low=0, expert=True)] = 0

    def __post_init__(self) -> None:
        check_settings(self, "routes")
        if self.max_hold_dist < self.min_hold_dist:
            raise SettingsError(
                "routes.max_hold_dist: expected at least routes.min_hold_dist "
                f"({self.min_hold_dist}), got {self.max_hold_dist}"
            )
