"""The evidence of all views for the triangles: one sparse table, gathered view by view."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from threading import local
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Progress, View
from walltopo.core.parallel import available_cores
from walltopo.geometry.screen import lens_of, valid_slope
from walltopo.segment.lift.blocks import Blocks
from walltopo.segment.lift.distance import distance_weight
from walltopo.segment.lift.label_image import STEPS, Canvas, ViewEvidence, by_face, mask_windows
from walltopo.segment.lift.visibility import (
    cull_blocks,
    distances,
    find_hidden,
    mark_candidates,
    place_samples,
    sum_samples,
)

# Side of the cells in which `mark_candidates` looks up masks before it looks up pixels.
WINDOW_PX = 16

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True)
class Sampling:
    """How triangles are sampled, and from which distance.

    Parameters
    ----------
    visibility_distance : metres; a triangle farther away is unseen.
    easing_power : see `distance_weight`.
    mask_resolution : see `label_size`.
    band : pixels around mask borders in which the distance to the border counts; 0 = hard borders.
    sample_px : a triangle whose longest edge is longer than this in pixels gets several samples.
    max_splits : square root of the maximum number of samples; 1 = the centroid alone, as published.
    """

    visibility_distance: float
    easing_power: float = 0.0
    mask_resolution: int = 0
    band: float = 0.0
    sample_px: float = 8.0
    max_splits: int = 1


@dataclass(frozen=True, eq=False)
class Evidence:
    """All observations of triangles by views, grouped by triangle, in the order of views.

    Parameters
    ----------
    faces : (C,) int32, mesh indices of the faces that some mask covers.
    areas : (C,) float64, their areas.
    starts : (C + 1,) int64, first entry of each face.
    projection : (N,) int32, number of the mask that covers the face in this view. If none does:
        -2 - m for mask m with a border within the band, else -1.
    view : (N,) int32.
    share : (N,) float32, the share of the face's visible samples that this entry represents.
    ease : (N,) float32, weight by distance.
    border : (N,) float32, distance to the mask's border in pixels, at most the band.
    detail : (N,) float32, pixels of the label image per metre at the triangle.
    first_mask : (views + 1,) int64; mask m of view v is projection `first_mask[v] + m`.
    label : (P,) int32, class; score : (P,) float64; of each mask.
    """

    faces: Ints
    areas: Floats
    starts: NDArray[np.int64]
    projection: Ints
    view: Ints
    share: NDArray[np.float32]
    ease: NDArray[np.float32]
    border: NDArray[np.float32]
    detail: NDArray[np.float32]
    first_mask: NDArray[np.int64]
    label: Ints
    score: Floats

    @property
    def view_of(self) -> Ints:
        """Return the view of each projection, (P,) int32."""
        counts = np.diff(self.first_mask)
        return np.repeat(np.arange(len(counts), dtype=np.int32), counts)


def gather_evidence(
    blocks: Blocks,
    views: Sequence[View],
    drawing: Callable[[View], list[int]],
    sampling: Sampling,
    progress: Progress,
) -> Evidence:
    """Return what every view sees of the triangles that lie under some mask.

    Parameters
    ----------
    drawing : returns the order in which a view's masks are drawn, later ones on top.

    Notes
    -----
    Two rounds over the views. The first finds the candidates: triangles under a mask, hidden or
    not. All other triangles can never get a label. The second tests the visibility of the
    candidates alone. Views are spread over threads, and their tables are joined in view order.
    """
    workers = available_cores()
    samplers = [_ViewSampler(blocks, view, drawing(view), sampling) for view in views]
    mark = np.zeros(len(blocks.faces), dtype=np.bool_)
    with ThreadPoolExecutor(workers) as pool:
        progress.step("find triangles under masks", len(views))
        canvases = _Canvases()
        for _ in pool.map(lambda sampler: sampler.mark(mark, canvases), samplers):
            progress.advance()
        candidates = np.flatnonzero(mark).astype(np.int32)
        targets = _Targets(blocks, candidates)
        progress.step("test visibility in every view", len(views))
        tables = []
        for table in pool.map(lambda sampler: sampler.observe(targets), samplers):
            tables.append(table)
            progress.advance()
    first_mask = np.cumsum([0, *(len(view.masks) for view in views)]).astype(np.int64)
    kept, starts, columns = by_face(tables, first_mask, len(candidates))
    masks = [mask for item in views for mask in item.masks]
    return Evidence(
        faces=blocks.original[candidates[kept]],
        areas=blocks.areas[candidates[kept]],
        starts=starts,
        projection=columns.projection,
        view=columns.view,
        share=columns.share,
        ease=columns.ease,
        border=columns.border,
        detail=columns.detail,
        first_mask=first_mask,
        label=np.array([mask.label for mask in masks], dtype=np.int32),
        score=np.array([mask.score for mask in masks], dtype=np.float64),
    )


class _Canvases(local):
    """One canvas per thread of the first round."""

    def __init__(self) -> None:
        self.canvas = Canvas()

    def own(self) -> Canvas:
        return self.canvas


class _Targets:
    """The candidates, and the first candidate of each block."""

    def __init__(self, blocks: Blocks, candidates: Ints) -> None:
        self.candidates = candidates
        self.starts = np.searchsorted(candidates, blocks.starts).astype(np.int64)
        self.number = np.full(len(blocks.faces), -1, dtype=np.int32)
        self.number[candidates] = np.arange(len(candidates), dtype=np.int32)
        self.buffers = local()

    def worker_buffers(self) -> Any:
        """Return the buffers of the calling thread, which are reused from view to view."""
        own = self.buffers
        if not hasattr(own, "canvas"):
            own.canvas = Canvas()
            own.where = np.zeros((len(self.candidates) + 1024, 3))
            own.owner = np.zeros(len(own.where), dtype=np.int32)
            own.label = np.zeros(len(own.where), dtype=np.int32)
            own.border = np.zeros(len(own.where), dtype=np.uint8)
        return own


class _ViewSampler:
    """Samples the triangles in one view."""

    def __init__(self, blocks: Blocks, view: View, order: list[int], sampling: Sampling) -> None:
        self.blocks, self.view, self.order, self.sampling = blocks, view, order, sampling
        camera = view.camera
        # Tuples, not arrays: kernels keep tuples in registers.
        self.lens = tuple(lens_of(camera).tolist())
        self.pose = tuple(view.cam_from_world.ravel().tolist())
        self.reach = min(valid_slope(camera), 1e9) if not camera.is_pinhole else 1e9

    def _draw(self, canvas: Canvas, band: float) -> Canvas:
        canvas.draw(self.view, self.order, self.sampling.mask_resolution, band)
        return canvas

    def _size(self, labels: Ints) -> tuple[float, float, float, float]:
        """Return width and height of the photo, and label pixels per photo pixel along both."""
        camera = self.view.camera
        across, down = labels.shape[1] / camera.width, labels.shape[0] / camera.height
        return float(camera.width), float(camera.height), across, down

    def _in_photo(self) -> Ints:
        bounds = slope_bounds(self.view.camera)
        limit = self.sampling.visibility_distance
        return cull_blocks(self.blocks.spheres, self.pose, bounds, limit)

    def mark(self, mark: NDArray[np.bool_], canvases: _Canvases) -> None:
        """Mark the faces under this view's masks (threads only ever set, never clear)."""
        if not self.order:
            return
        blocks, sampling = self.blocks, self.sampling
        labels = self._draw(canvases.own(), 0.0).code
        windows = mask_windows(self.view, self.order, WINDOW_PX)
        mark_candidates(
            self._in_photo(),
            blocks.starts,
            blocks.spheres,
            blocks.vertices,
            blocks.faces,
            blocks.centroids,
            blocks.longest,
            self.pose,
            self.lens,
            self.reach,
            self._size(labels),
            labels,
            sampling.visibility_distance,
            sampling.sample_px,
            sampling.max_splits,
            windows,
            WINDOW_PX,
            mark,
        )

    def _place_samples(self, targets: _Targets, in_photo: Ints, canvas: Canvas) -> int:
        """Fill the worker's buffers with samples of the candidates; return their number."""
        blocks, sampling = self.blocks, self.sampling
        own, size = targets.worker_buffers(), self._size(canvas.code)
        while True:
            count = place_samples(
                in_photo,
                targets.starts,
                targets.candidates,
                blocks.vertices,
                blocks.faces,
                blocks.centroids,
                blocks.longest,
                self.pose,
                self.lens,
                self.reach,
                size,
                canvas.code,
                canvas.distance,
                sampling.visibility_distance,
                sampling.sample_px,
                sampling.max_splits,
                own.where,
                own.owner,
                own.label,
                own.border,
            )
            if count <= len(own.owner):
                return count
            own.where = np.zeros((count * 5 // 4, 3))
            own.owner = np.zeros(len(own.where), dtype=np.int32)
            own.label = np.zeros(len(own.where), dtype=np.int32)
            own.border = np.zeros(len(own.where), dtype=np.uint8)

    def observe(self, targets: _Targets) -> ViewEvidence:
        """Return the evidence of this view for the candidates that it sees."""
        blocks, sampling, pose = self.blocks, self.sampling, self.pose
        in_photo = self._in_photo()
        own = targets.worker_buffers()
        canvas = self._draw(own.canvas, sampling.band)
        labels = canvas.code
        count = self._place_samples(targets, in_photo, canvas)
        where, owner = own.where[:count], own.owner[:count]
        hidden = np.zeros(0, dtype=np.bool_)
        if count:
            hidden = find_hidden(
                in_photo,
                blocks.starts,
                blocks.vertex_starts,
                blocks.spheres,
                blocks.vertices,
                blocks.faces,
                targets.number,
                pose,
                self.view.camera.fx,
                where,
                owner,
            )
        face, label, share, border = sum_samples(
            owner, own.label[:count], own.border[:count], hidden
        )
        centre = tuple(self.view.centre.tolist())
        range_ = distances(blocks.centroids, targets.candidates, face, centre)
        eased = distance_weight(range_, sampling.visibility_distance, sampling.easing_power)
        focal = self.view.camera.fx * labels.shape[1] / self.view.camera.width
        return ViewEvidence(
            face,
            label,
            share,
            eased.astype(np.float32),
            border / np.float32(STEPS),
            (focal / np.maximum(range_, 1e-300)).astype(np.float32),
        )


def slope_bounds(camera: Camera) -> Floats:
    """Return (4,) minimum and maximum x/z, then y/z, of the photo; infinite if unknown."""
    if camera.is_pinhole:
        x = (np.array([0.0, camera.width]) - camera.cx) / camera.fx
        y = (np.array([0.0, camera.height]) - camera.cy) / camera.fy
        return np.array([*x, *y])
    from walltopo.geometry.colmap import pycolmap

    lens = pycolmap.Camera(
        model=camera.model, width=camera.width, height=camera.height, params=camera.params
    )
    along = np.linspace(0.0, 1.0, 65)[:, None]
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.0]]) * [camera.width, camera.height]
    border = np.concatenate([a + along * (b - a) for a, b in pairwise(corners)])
    slopes = np.asarray(lens.cam_from_img(border), dtype=np.float64)
    if not np.isfinite(slopes).all():
        return np.array([-np.inf, np.inf, -np.inf, np.inf])
    # The border is sampled, and barrel distortion bows it outwards between samples.
    margin = 0.02 * np.ptp(slopes, axis=0)
    low, high = slopes.min(axis=0) - margin, slopes.max(axis=0) + margin
    return np.array([low[0], high[0], low[1], high[1]])
