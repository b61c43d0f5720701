"""Find bodies in a picture, and the 33 points of a body's pose.

The networks are BlazePose (Bazarevsky et al., "BlazePose: On-device real-time body pose tracking",
2020) as MediaPipe publishes them. The rules around them are MediaPipe's: anchors, weighted
non-maximum suppression, the turned square around a body, and points refined by their heatmaps.

People are found by `walltopo.images.people` first, for two reasons. BlazePose's detector is for
people close by: of 17 climbers in 1080 x 1920 frames, 575 pixels tall, it found 5 in the whole
frame, and 13 in the surroundings of the people found. Holds deceive BlazePose: in photos of walls
without people, it found bodies of a presence up to 1. Their points have little heat: see
`Pose.is_clear`.

Pixels are continuous: (0, 0) is the upper left corner of a picture, (.5, .5) the middle of its
first pixel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.networks import open_network
from walltopo.images.people import Person, find_people
from walltopo.segment.detect.photo_detections import box_iou

Image = NDArray[np.uint8]
Floats = NDArray[np.float64]

POINTS = 33
MIN_SCORE = 0.5  # presence of a body from which its pose counts
_DETECTOR_SIDE, _SIDE = 224, 256  # pixels of the pictures that the networks are shown
_STRIDES = ((8, 2), (16, 2), (32, 6))  # pixels of a cell, anchors of a cell
_MIN_BODY_SCORE = 0.5  # of the detector
_SAME_BODY = 0.3  # intersection over union of boxes from which they are one body
_REGION_SCALE = 2.5  # side of a body's square, in distances from the hips to the scale point
_HIPS, _SCALE_POINT = 33, 34  # among the landmark network's 39 points
_WINDOW = 7  # cells of a heatmap around a point that refine it
_MARGIN = 1.3  # side of a person's surroundings, in longer sides of the person's box
# Presence and heat from which a pose is clear: in 178 photos of walls, 78 poses of people have a
# median heat of .76, 39 of holds a 95th percentile of .50.
_CLEAR_SCORE, _CLEAR_HEAT = 0.9, 0.55
_MIN_HEAT = 0.5  # maximum in the window from which the point is refined


class Point(IntEnum):
    """Row of a point of the body in `Pose.points`; left and right are the person's own."""

    NOSE = 0
    LEFT_EAR = 7
    RIGHT_EAR = 8
    LEFT_SHOULDER = 11
    RIGHT_SHOULDER = 12
    LEFT_ELBOW = 13
    RIGHT_ELBOW = 14
    LEFT_WRIST = 15
    RIGHT_WRIST = 16
    LEFT_LITTLE_FINGER = 17
    RIGHT_LITTLE_FINGER = 18
    LEFT_INDEX = 19
    RIGHT_INDEX = 20
    LEFT_THUMB = 21
    RIGHT_THUMB = 22
    LEFT_HIP = 23
    RIGHT_HIP = 24
    LEFT_KNEE = 25
    RIGHT_KNEE = 26
    LEFT_ANKLE = 27
    RIGHT_ANKLE = 28
    LEFT_HEEL = 29
    RIGHT_HEEL = 30
    LEFT_TOES = 31
    RIGHT_TOES = 32


FEET = (
    Point.LEFT_ANKLE,
    Point.RIGHT_ANKLE,
    Point.LEFT_HEEL,
    Point.RIGHT_HEEL,
    Point.LEFT_TOES,
    Point.RIGHT_TOES,
)


@dataclass(frozen=True)
class Region:
    """A square of a frame that contains a body, turned so that the body stands upright in it.

    Parameters
    ----------
    x, y : centre, pixels of the frame.
    size : side, pixels of the frame.
    angle : turn from upright, radians, clockwise.
    """

    x: float
    y: float
    size: float
    angle: float

    @classmethod
    def around(cls, hips: Floats, scale_point: Floats) -> Region:
        """Return the square of a body.

        Parameters
        ----------
        hips : (2,) middle between the hips, pixels.
        scale_point : (2,) point beyond the head or the feet; the circle through it around the hips
            contains the body.
        """
        across, down = (scale_point - hips).tolist()
        reach = float(np.hypot(across, down))
        return cls(
            float(hips[0]), float(hips[1]), _REGION_SCALE * reach, float(np.arctan2(across, -down))
        )

    @property
    def centre(self) -> Floats:
        """Return the (2,) centre, pixels."""
        return np.array([self.x, self.y])

    def to_frame(self, shares: Floats) -> Floats:
        """Return (N, 2) pixels of the frame of (N, 2) places in the square, each 0 to 1."""
        return self.centre + (shares - 0.5) * self.size @ self._axes()

    def to_square(self, points: Floats) -> Floats:
        """Return (N, 2) places in the square, each 0 to 1 inside, of (N, 2) pixels of the frame."""
        return (points - self.centre) @ self._axes().T / self.size + 0.5

    def cut(self, frame: Image, side: int) -> Image:
        """Return the square as (side, side, 3) picture; pixels outside the frame repeat its edge.

        Parameters
        ----------
        frame : (H, W, 3) uint8.
        """
        scale = self.size / side
        # Middles of pixels of the square to indices of the frame, as OpenCV counts pixels.
        turn = self._axes().T * scale
        first = self.to_frame(np.full((1, 2), 0.5 / side))[0] - 0.5
        matrix = np.column_stack([turn, first])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        cut = cv2.warpAffine(
            frame, matrix, (side, side), flags=flags, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(cut, np.uint8)

    def _axes(self) -> Floats:
        """Return the square's unit vectors right and down, as rows, in the frame."""
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        return np.array([[cos, sin], [-sin, cos]])


@dataclass(frozen=True, eq=False)
class Pose:
    """A body in a frame.

    Parameters
    ----------
    points : (33, 2) float64 pixels of the frame; rows as in `Point`.
    confidence : (33,) float64 in 0..1: that the point is inside the picture, times that nothing
        hides it.
    score : presence of a body, 0..1.
    region : the square around the body, for the next frame.
    heat : mean over the points of their heatmaps' maxima, 0..1.
    """

    points: Floats
    confidence: Floats
    score: float
    region: Region
    heat: float = 1.0

    @property
    def is_clear(self) -> bool:
        """Return whether the pose alone shows a person, and not holds that look like one."""
        return self.score >= _CLEAR_SCORE and self.heat >= _CLEAR_HEAT


@dataclass(frozen=True)
class Body:
    """A body that was found: its square, and its score in 0..1."""

    region: Region
    score: float


class Session(Protocol):
    """The part of `onnxruntime.InferenceSession` that is used."""

    def run(self, outputs: Sequence[str], inputs: Mapping[str, Any], /) -> Sequence[Any]:
        """Return the named outputs of the network."""


class PoseReader(Protocol):
    """Finds bodies, and reads their poses."""

    def find_bodies(self, frame: Image) -> list[Body]:
        """Return the bodies in a frame, the highest score first."""

    def shows_body(self, frame: Image, pose: Pose) -> bool:
        """Return whether a pose of this frame is that of a person, and not of holds."""

    def read_pose(self, frame: Image, region: Region) -> Pose:
        """Return the pose of the body in a square; a low score means that there is no body."""


@dataclass(frozen=True, eq=False)
class PoseNetworks:
    """The detector of bodies and the network of their points."""

    detector: Session
    landmarks: Session

    @classmethod
    def load(cls, folder: Path, threads: int = 1) -> PoseNetworks:
        """Return the networks `pose_detector.onnx` and `pose_landmarks.onnx` of a folder.

        Raises
        ------
        InputError : a file is missing or not ONNX.
        """
        names = ("pose_detector.onnx", "pose_landmarks.onnx")
        detector, landmarks = (open_network(folder / name, threads=threads) for name in names)
        return cls(detector.session, landmarks.session)

    def find_bodies(self, frame: Image) -> list[Body]:
        """Return the people in a (H, W, 3) uint8 RGB frame, the highest score first.

        A person in whose surroundings the detector finds no body is taken to be upright. If no
        people are found, BlazePose searches alone, in parts of the frame, for clear poses.
        """
        people = find_people(frame)
        return [self._aligned(frame, person) for person in people] or self._clear_bodies(frame)

    def shows_body(self, frame: Image, pose: Pose) -> bool:
        """Return whether a pose is clear, or a person is in the middle half of its square."""
        if pose.is_clear:
            return True
        part, corner = _cut_square(frame, pose.region.centre, pose.region.size)
        middle, reach = pose.region.centre - corner, pose.region.size / 4
        for person in find_people(part):
            x0, y0, x1, y1 = person.box
            if x0 - reach < middle[0] < x1 + reach and y0 - reach < middle[1] < y1 + reach:
                return True
        return False

    def _aligned(self, frame: Image, person: Person) -> Body:
        """Return the body of a person whose box is known."""
        box = np.array(person.box).reshape(2, 2)
        middle, side = box.mean(axis=0), _MARGIN * float((box[1] - box[0]).max())
        part, corner = _cut_square(frame, middle, side)
        regions = [_shifted(body.region, corner) for body in self.detect(part)]
        nearest = min(
            regions,
            key=lambda region: float(np.hypot(*(region.centre - middle))),
            default=Region(float(middle[0]), float(middle[1]), side, 0.0),
        )
        return Body(nearest, person.score)

    def _clear_bodies(self, frame: Image) -> list[Body]:
        """Return the bodies with a clear pose in overlapping squares of a frame."""
        found: list[tuple[float, Region]] = []
        for middle, side in _search_squares(frame):
            part, corner = _cut_square(frame, middle, side)
            for body in self.detect(part):
                pose = self.read_pose(frame, _shifted(body.region, corner))
                if pose.is_clear:
                    found.append((pose.heat, pose.region))
        bodies: list[Body] = []
        for heat, region in sorted(found, key=lambda each: -each[0]):
            centres = [body.region.centre for body in bodies]
            if all(np.hypot(*(region.centre - c)) > region.size / 4 for c in centres):
                bodies.append(Body(region, heat))
        return bodies

    def detect(self, frame: Image) -> list[Body]:
        """Return the bodies that BlazePose's detector finds in a frame, the highest score first."""
        picture, scale, margin = _letterbox(frame)
        values = picture.astype(np.float32) * np.float32(2 / 255) - 1
        inputs = {"pictures": values.transpose(2, 0, 1)[None]}
        boxes, scores = self.detector.run(["boxes", "scores"], inputs)
        found = []
        for row, score in distinct(*decode(boxes[0], scores[0, :, 0])):
            places = row[4:8].reshape(2, 2) * _DETECTOR_SIDE
            hips, scale_point = (places - margin) / scale
            found.append(Body(Region.around(hips, scale_point), score))
        return found

    def read_pose(self, frame: Image, region: Region) -> Pose:
        """Return the pose of the body in a square of a (H, W, 3) uint8 RGB frame."""
        values = region.cut(frame, _SIDE).astype(np.float32) / np.float32(255)
        inputs = {"pictures": values.transpose(2, 0, 1)[None]}
        names = ["points", "presence", "heatmaps"]
        rows, presence, heatmaps = self.landmarks.run(names, inputs)
        rows = np.asarray(rows, np.float64).reshape(-1, 5)
        logits = np.asarray(heatmaps[0], np.float64)
        places = refined(rows[:, :2] / _SIDE, logits)
        points = region.to_frame(places)
        confidence = _sigmoid(rows[:POINTS, 3]) * _sigmoid(rows[:POINTS, 4])
        around = Region.around(points[_HIPS], points[_SCALE_POINT])
        heat = float(_sigmoid(logits[:POINTS].max(axis=(1, 2))).mean())
        return Pose(points[:POINTS], confidence, float(presence.ravel()[0]), around, heat)


@cache
def shipped_networks() -> PoseNetworks:
    """Return the networks that come with the package."""
    return PoseNetworks.load(Path(str(resources.files("walltopo_climb") / "models")))


def check_frame(frame: Any, number: int) -> Image:
    """Return a frame if it is a picture.

    Raises
    ------
    InputError : it is not (H, W, 3) uint8, or has no pixels.
    """
    if not isinstance(frame, np.ndarray) or frame.dtype != np.uint8:
        kind = getattr(frame, "dtype", type(frame).__name__)
        raise InputError(f"frame {number}: expected a picture of uint8, got {kind}")
    if frame.ndim != 3 or frame.shape[2] != 3 or not frame.size:
        raise InputError(f"frame {number}: expected (H, W, 3), got {frame.shape}")
    return frame


@cache
def anchors() -> Floats:
    """Return the (2254, 2) middles of the detector's anchors, as shares of the picture's side."""
    layers = []
    for stride, count in _STRIDES:
        cells = _DETECTOR_SIDE // stride
        y, x = np.mgrid[:cells, :cells]
        middles = (np.stack([x, y], axis=-1).reshape(-1, 2) + 0.5) / cells
        layers.append(np.repeat(middles, count, axis=0))
    return np.concatenate(layers)


def decode(raw: NDArray[np.float32], logits: NDArray[np.float32]) -> tuple[Floats, Floats]:
    """Return the boxes and key points of the anchors that may show a body, and their scores.

    Parameters
    ----------
    raw : (2254, 12) offsets from the anchors, pixels: middle, sizes, four key points.
    logits : (2254,) scores before the sigmoid.

    Returns
    -------
    (n, 12) shares of the picture's side: x and y of the middle of the face's box, its width and
    height, x and y of the hips, the scale point, the shoulders and the upper body's scale point;
    (n,) scores in 0..1.
    """
    scores = _sigmoid(np.clip(logits.astype(np.float64), -100, 100))
    good = scores >= _MIN_BODY_SCORE
    rows = raw[good].astype(np.float64).reshape(-1, 6, 2) / _DETECTOR_SIDE
    offsets = anchors()[good][:, None].repeat(6, axis=1)
    offsets[:, 1] = 0  # sizes
    return (rows + offsets).reshape(-1, 12), scores[good]


def distinct(rows: Floats, scores: Floats) -> list[tuple[Floats, float]]:
    """Return one row per body, the highest score first.

    Boxes that overlap the best one are replaced by their mean, weighted by the scores.

    Parameters
    ----------
    rows, scores : as `decode` returns them.
    """
    found = []
    middles, halves = rows[:, :2], rows[:, 2:4] / 2
    corners = np.concatenate([middles - halves, middles + halves], axis=1)
    left = np.argsort(-scores, kind="stable")
    while len(left):
        same = box_iou(corners[left[:1]], corners[left])[0] > _SAME_BODY
        same[0] = True
        group = left[same]
        mean = np.average(rows[group], axis=0, weights=scores[group])
        found.append((mean, float(scores[left[0]])))
        left = left[~same]
    return found


def refined(places: Floats, heatmaps: Floats) -> Floats:
    """Return points moved to the middle of the heat around them, where there is enough heat.

    Parameters
    ----------
    places : (N, 2) x and y, shares of the picture's side.
    heatmaps : (N, h, w) logits.
    """
    count, height, width = heatmaps.shape
    cells = np.trunc(places * (width, height)).astype(int)
    inside = ((places >= 0) & (cells < (width, height))).all(axis=1)
    reach = np.arange(_WINDOW) - _WINDOW // 2
    columns, rows = (cells[:, k, None] + reach for k in (0, 1))
    good = ((rows >= 0) & (rows < height))[:, :, None] & ((columns >= 0) & (columns < width))[
        :, None
    ]
    number = np.arange(count)[:, None, None]
    at = rows.clip(0, height - 1)[:, :, None], columns.clip(0, width - 1)[:, None]
    heat = np.where(good, _sigmoid(heatmaps[number, at[0], at[1]]), 0.0)
    total = heat.sum(axis=(1, 2))
    x, y = (heat * columns[:, None]).sum(axis=(1, 2)), (heat * rows[:, :, None]).sum(axis=(1, 2))
    strong = inside & (heat.max(axis=(1, 2)) >= _MIN_HEAT)
    middles = np.column_stack([x / width, y / height]) / np.maximum(total, 1e-9)[:, None]
    return np.where(strong[:, None], middles, places)


def _search_squares(frame: Image) -> list[tuple[Floats, float]]:
    """Return middles and sides of squares over a frame, pixels: as large as fits, and half that.

    Neighbours overlap by half.
    """
    height, width = frame.shape[:2]
    squares = []
    for side in (min(height, width), min(height, width) / 2):
        rows, columns = (
            np.linspace(side / 2, length - side / 2, 1 + round(2 * (length / side - 1)))
            for length in (height, width)
        )
        squares += [(np.array([x, y]), float(side)) for y in rows for x in columns]
    return squares


def _cut_square(frame: Image, middle: Floats, side: float) -> tuple[Image, Floats]:
    """Return the part of a frame inside an upright square, and its upper left corner, (2,) x, y.

    The part has at least one pixel.
    """
    height, width = frame.shape[:2]
    last = np.array([width, height])
    low = np.floor(middle - side / 2).astype(int).clip(0, last - 1)
    high = np.ceil(middle + side / 2).astype(int).clip(low + 1, last)
    return frame[low[1] : high[1], low[0] : high[0]], low.astype(np.float64)


def _shifted(region: Region, by: Floats) -> Region:
    return Region(region.x + float(by[0]), region.y + float(by[1]), region.size, region.angle)


def _letterbox(frame: Image) -> tuple[Image, Floats, Floats]:
    """Return the detector's picture of a frame, its scale and its margin, (2,) each, x and y."""
    height, width = frame.shape[:2]
    factor = _DETECTOR_SIDE / max(height, width)
    size = max(1, round(width * factor)), max(1, round(height * factor))
    left, top = ((_DETECTOR_SIDE - length) // 2 for length in size)
    picture = np.zeros((_DETECTOR_SIDE, _DETECTOR_SIDE, 3), np.uint8)
    small = cv2.resize(frame, size, interpolation=cv2.INTER_AREA)
    picture[top : top + size[1], left : left + size[0]] = small
    scale = np.array([size[0] / width, size[1] / height])
    return picture, scale, np.array([left, top], np.float64)


def _sigmoid(values: Floats) -> Floats:
    return 1 / (1 + np.exp(-np.clip(values, -100, 100)))
