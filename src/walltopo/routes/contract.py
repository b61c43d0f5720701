"""Settings of the `routes` stage."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import SettingsError, check_settings, setting

__all__ = ["RoutesSettings"]


@dataclass(frozen=True)
class RoutesSettings:
    """How holds of one colour are grouped into routes (section `routes`)."""

    min_hold_dist: float = setting(
        0.6, "Holds nearer than this along the wall are fully similar", unit="m", low=0, high=5
    )
    max_hold_dist: float = setting(
        1.6, "Holds farther than this along the wall are not linked", unit="m", low=0, high=10
    )
    flatten_ratio: float = setting(
        0.2, "The vertical part of a path counts by this factor (routes go up)", low=0, high=1
    )
    resolution: float = setting(
        0.5, "Resolution of Louvain: larger gives more, smaller routes", low=0, high=100
    )
    maker_weight: float = setting(
        0.75,
        "How much less similar two holds of one colour are whose makers are known and differ",
        low=0,
        high=1,
    )
    start_tags: bool = setting(
        True, "Cut a group where start tags mark several starts, and start routes at their tags"
    )
    link: str = setting(
        "colour",
        "colour: holds of one colour name are linked; paint: holds of like paint, for scans "
        "whose light is too uneven to name colours (see docs/routes.md)",
        choices=("colour", "paint"),
    )
    paint_resolution: float = setting(
        2.0, "With link = paint: resolution of Louvain over all colours", low=0, high=100
    )
    min_holds: int = setting(2, "Groups with fewer holds are left without a route", low=1, high=50)
    proxy_faces: int = setting(
        20_000, "Triangles of the simplified wall that paths run on", low=100, high=2_000_000
    )
    bridge_gap: float = setting(
        0.5,
        "Parts of the wall that end this near each other count as joined",
        unit="m",
        low=0,
        high=5,
    )
    typical_hold: float = setting(
        0.15,
        "Median hold size assumed where the scan has no scale; sets the unit of the distances",
        unit="m",
        low=0.02,
        high=1,
    )
    ambiguous_above: float = setting(
        0.3, "A second route with at least this probability makes a hold ambiguous", low=0, high=0.5
    )
    threads: int = setting(0, "Worker threads for the paths; 0: as many as cores", low=0, high=256)
    seed: int = setting(0, "Seed of Louvain", low=0)

    def __post_init__(self) -> None:
        check_settings(self, "routes")
        if self.max_hold_dist < self.min_hold_dist:
            raise SettingsError(
                "routes.max_hold_dist: expected at least routes.min_hold_dist "
                f"({self.min_hold_dist}), got {self.max_hold_dist}"
            )
