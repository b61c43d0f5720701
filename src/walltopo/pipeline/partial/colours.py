"""Decide which holds a partial rescan exchanges if it is for some colours only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from walltopo.core import SettingsError
from walltopo.describe.matching.holds import match_holds
from walltopo.pipeline.partial.region import Exchange, Region
from walltopo.pipeline.settings import Settings
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds


def colours_of(setting: str) -> tuple[str, ...]:
    """Return the names in the setting `sparse.part_colours`."""
    return tuple(name.strip() for name in setting.split(",") if name.strip())


def check_colours(settings: Settings) -> None:
    """Check the names of `sparse.part_colours` before a scan starts.

    Raises
    ------
    SettingsError : neither the palette nor a hold of the reference has such a colour.
    InputError : the palette or the reference's `holds.json` is missing or damaged.
    """
    wanted = colours_of(settings.sparse.part_colours)
    if not wanted:
        return
    from walltopo.describe.classify.palette import REFERENCE, read_palette

    classify = settings.classify
    names = set(REFERENCE)
    if classify.palette:
        entries = read_palette(Path(classify.palette), classify.lightness_weight)
        names = {entry.name for entry in entries}
    names |= {hold.colour for hold in Holds.load(ScanFolder(settings.sparse.reference).holds).holds}
    unknown = sorted(set(wanted) - names)
    if unknown:
        raise SettingsError(
            f"sparse.part_colours: no colour is named {', '.join(unknown)}",
            f"The colours are {', '.join(sorted(names))}.",
        )


@dataclass(frozen=True)
class ColourChoice:
    """The instances that are exchanged.

    Parameters
    ----------
    exchange : None: all instances of both scans.
    same : old hold to new hold, for holds that both scans contain; empty for all colours.
    """

    exchange: Exchange | None = None
    same: Mapping[int, int] = field(default_factory=dict)

    @classmethod
    def of(cls, colours: tuple[str, ...], old: Holds, shown: Holds, new: Holds) -> ColourChoice:
        """Return the choice for some colours.

        A hold that both scans contain has the colour that the old scan gives it, because light and
        palette change between scans.

        Parameters
        ----------
        colours : empty: all.
        old, new : the tables of both scans before any edit.
        shown : the old table after its edits, whose colours count.
        """
        if not colours:
            return cls()
        same = match_holds(old.holds, new.holds, old.unit)
        corrected = {hold.id: hold.colour for hold in shown.holds}
        before = {
            hold.id
            for hold in (*old.holds, *old.left_out)
            if corrected.get(hold.id, hold.colour) in colours
        }
        after = {hold.id for hold in (*new.holds, *new.left_out) if hold.colour in colours}
        after -= set(same.values())
        after |= {same[number] for number in before & same.keys()}
        return cls(Exchange(frozenset(before), frozenset(after)), same)

    def missing(self, region: Region, old: Holds) -> list[int]:
        """Return the ids of old holds that stay, but that the photos of their place do not show."""
        return sorted(region.held & {hold.id for hold in old.holds} - self.same.keys())

    def ignored(self, region: Region, new: Holds) -> int:
        """Return the number of new holds that are not added and are no old hold."""
        return len(region.ignored & {hold.id for hold in new.holds} - set(self.same.values()))
