"""Lift evidence for any visibility distance and easing, from a single visibility computation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from walltopo.core import Mesh, Silent, View
from walltopo.segment.lift.blocks import blocks_of
from walltopo.segment.lift.distance import distance_weight
from walltopo.segment.lift.evidence import Evidence, Sampling, gather_evidence


class SeenOnce:
    """Visibility, computed once at the largest distance and with the widest border band.

    With linear easing (power 0) the weight of an entry is 1 - distance / farthest. The distance
    of every entry follows from it. Each trial only filters and weights the entries again.

    Parameters
    ----------
    drawing : order in which a view's masks are drawn, see `gather_evidence`.
    sampling : with the largest visibility distance and band that will be requested.
    """

    def __init__(
        self,
        mesh: Mesh,
        views: Sequence[View],
        drawing: Callable[[View], list[int]],
        sampling: Sampling,
    ) -> None:
        linear = replace(sampling, easing_power=0.0)
        self._all = gather_evidence(blocks_of(mesh), views, drawing, linear, Silent())
        farthest = sampling.visibility_distance
        self._distance = farthest * (1.0 - self._all.ease.astype(np.float64))

    def evidence(
        self, visibility_distance: float, easing_power: float, band: float = 0.0
    ) -> Evidence:
        """Return the result of `gather_evidence` for these settings, up to rounding.

        With a band narrower than the computed one, entries beyond it keep the number of the nearest
        mask; at the full width of the band that number has no weight.
        """
        near = self._distance < visibility_distance
        counts = np.concatenate([[0], np.cumsum(near)])
        starts = counts[self._all.starts]
        weight = distance_weight(self._distance[near], visibility_distance, easing_power)
        # Faces that no near entry assigns to a mask cannot get a label; a new computation omits
        # them too.
        on_mask = np.concatenate([[0], np.cumsum(near & (self._all.projection >= 0))])
        useful = on_mask[self._all.starts[1:]] > on_mask[self._all.starts[:-1]]
        entries = np.repeat(useful, np.diff(starts))
        lengths = np.diff(starts)[useful]
        pick = np.flatnonzero(near)[entries]
        return replace(
            self._all,
            faces=self._all.faces[useful],
            areas=self._all.areas[useful],
            starts=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
            projection=self._all.projection[pick],
            view=self._all.view[pick],
            share=self._all.share[pick],
            ease=weight[entries].astype(np.float32),
            border=np.minimum(self._all.border[pick], np.float32(band)),
            detail=self._all.detail[pick],
        )
