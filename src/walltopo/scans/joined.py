"""`joined.json`: the parts of its reference that a partial rescan replaced (`sparse.part`)."""

from __future__ import annotations

from walltopo.scans.document import Document, Label
from walltopo.scans.edits import Place


class Joined(Document, frozen=True, kw_only=True):
    """`joined.json`.

    Parameters
    ----------
    replaced_share : share of the reference's surface that the new photos replaced.
    seam_mm : 95th percentile of the distance between both surfaces along the seam; None if they
        nowhere meet.
    photos_kept, photos_new : numbers of photos of the reference and of the rescan.
    stays : ids of holds that were not photographed or are of other colours; same : photographed and
        unchanged; gone : no more there; added : new.
    seam : lines along which replaced surface meets the rest, points in the scan's frame.
    colours : only holds of these colours were exchanged; empty: all (`sparse.part_colours`).
    missing : ids of holds of other colours that stay, although the photos do not show them.
    ignored : number of new holds that were not added, because of their colour or because a hold of
        another colour stays in their place.
    """

    replaced_share: float
    seam_mm: float | None
    photos_kept: int
    photos_new: int
    stays: tuple[Label, ...]
    same: tuple[Label, ...]
    gone: tuple[Label, ...]
    added: tuple[Label, ...]
    seam: tuple[tuple[Place, ...], ...] = ()
    colours: tuple[str, ...] = ()
    missing: tuple[Label, ...] = ()
    ignored: int = 0

    @property
    def summary(self) -> str:
        """Return one sentence for people."""
        off = self.seam_mm
        seam = "" if off is None else f"; 95 % of the seam is off by at most {off:.1f} mm"
        left, only = "not photographed", ""
        if self.colours:
            left = "not exchanged"
            only = (
                f"; only {', '.join(self.colours)}: {len(self.missing)} holds of other colours are "
                f"not on the photos and stay, {self.ignored} new holds ignored"
            )
        return (
            f"{100 * self.replaced_share:.0f} % of the wall replaced: {len(self.added)} holds new, "
            f"{len(self.gone)} gone, {len(self.same)} unchanged, {len(self.stays)} "
            f"{left}{seam}{only}"
        )
