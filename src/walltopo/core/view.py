"""Define the view: a camera, its pose and the masks of one photo."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core.errors import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class View:
    """A posed photo with its masks.

    Parameters
    ----------
    name : the photo's file name.
    camera : intrinsics.
    cam_from_world : (3, 4) float, rotation | translation; world metres to the camera frame of
        COLMAP (x right, y down, z forward).
    masks : the masks of the photo, in its proportions but at any resolution.

    Raises
    ------
    InputError : the pose is not a finite rigid transform, or a mask has other proportions.

    Examples
    --------
    A camera at the origin that looks along z:

    >>> import numpy as np
    >>> from walltopo.core import Camera
    >>> camera = Camera("PINHOLE", 640, 480, (520.0, 520.0, 320.0, 240.0))
    >>> view = View("IMG_0001.jpg", camera, np.eye(4)[:3])
    >>> view.direction.tolist()
    [0.0, 0.0, 1.0]
    """

    name: str
    camera: Camera
    cam_from_world: Floats
    masks: tuple[Mask, ...] = field(default=())

    def __post_init__(self) -> None:
        pose = np.ascontiguousarray(self.cam_from_world, dtype=np.float64)
        if pose.shape != (3, 4):
            raise InputError(f"{self.name}: cam_from_world: expected (3, 4), got {pose.shape}")
        rotation = pose[:, :3]
        if not np.isfinite(pose).all() or np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-4:
            raise InputError(f"{self.name}: cam_from_world is not a finite rigid transform")
        object.__setattr__(self, "cam_from_world", pose)
        for width, height in {(mask.width, mask.height) for mask in self.masks}:
            self._check_proportions(width, height)

    def _check_proportions(self, width: int, height: int) -> None:
        """Raise InputError if masks of this size do not show the camera's whole photo."""
        wide, high = self.camera.width, self.camera.height
        if _same_proportions((width, height), (wide, high)):
            return
        hint = "Masks must show the whole photo, at any resolution."
        if _same_proportions((height, width), (wide, high)):
            hint = (
                "The sides are swapped: the masks were drawn on the photo as its EXIF orientation "
                "turns it, and the camera belongs to the photo as it is stored. Turn the photos "
                "before both steps (for example by `mogrify -auto-orient`), or turn the masks back."
            )
        raise InputError(
            f"{self.name}: its masks are {width}x{height} pixels, its camera {wide}x{high}", hint
        )

    @property
    def centre(self) -> Floats:
        """Return the (3,) camera centre in the world frame."""
        return -self.cam_from_world[:, :3].T @ self.cam_from_world[:, 3]

    @property
    def direction(self) -> Floats:
        """Return the (3,) unit viewing direction (camera z axis) in the world frame."""
        return self.cam_from_world[2, :3].copy()

    def to_camera(self, points: Floats) -> Floats:
        """Transform world points (..., 3) to the camera frame."""
        return points @ self.cam_from_world[:, :3].T + self.cam_from_world[:, 3]

    def project(self, points: Floats) -> Floats:
        """Return the pixels (..., 2) of world points (..., 3); NaN behind the camera."""
        return self.camera.project(self.to_camera(points))

    def with_masks(self, masks: tuple[Mask, ...]) -> View:
        """Return the same view with other masks."""
        return replace(self, masks=masks)


# Masks of undistorted photos may be cropped by a few pixels.
_PROPORTION_TOLERANCE = 0.01


def _same_proportions(a: tuple[int, int], b: tuple[int, int]) -> bool:
    """Return whether two sizes differ by resolution only, up to a pixel and the tolerance."""
    difference = abs(a[0] * b[1] - a[1] * b[0])
    return difference <= max(_PROPORTION_TOLERANCE * a[1] * b[0], b[0] + b[1])


@dataclass(frozen=True, eq=False)
class Mask:
    """An object detected in a photo.

    Parameters
    ----------
    bitmap : (h, w) bool, the mask within its bounding box.
    x, y : column and row of the bitmap's top-left pixel in the photo.
    width, height : size in pixels of the image of the mask; if it differs from the photo's size,
        the mask is scaled when used.
    label : class id, >= 1 (0 means none).
    score : confidence in (0, 1].

    Examples
    --------
    >>> import numpy as np
    >>> image = np.zeros((480, 640), dtype=np.bool_)
    >>> image[100:110, 200:220] = True
    >>> mask = Mask.from_full(image, label=1, score=0.9)
    >>> mask.box, mask.area
    ((200, 100, 20, 10), 200)
    """

    bitmap: NDArray[np.bool_]
    x: int
    y: int
    width: int
    height: int
    label: int
    score: float

    def __post_init__(self) -> None:
        if self.bitmap.ndim != 2 or self.bitmap.dtype != np.bool_:
            raise InputError(
                f"mask bitmap: expected (h, w) bool, got {self.bitmap.shape} {self.bitmap.dtype}"
            )
        h, w = self.bitmap.shape
        if self.x < 0 or self.y < 0 or self.x + w > self.width or self.y + h > self.height:
            raise InputError(
                f"mask of {w}x{h} at ({self.x}, {self.y}) extends beyond its image of "
                f"{self.width}x{self.height}"
            )
        if self.label < 1:
            raise InputError(f"mask label: expected >= 1, got {self.label}")
        if not 0.0 < self.score <= 1.0:
            raise InputError(f"mask score: expected in (0, 1], got {self.score}")

    @classmethod
    def from_full(cls, bitmap: NDArray[np.bool_], label: int, score: float = 1.0) -> Mask:
        """Crop a full-size (H, W) bool bitmap to its bounding box (an empty bitmap becomes 0x0)."""
        height, width = bitmap.shape
        rows, cols = np.flatnonzero(bitmap.any(axis=1)), np.flatnonzero(bitmap.any(axis=0))
        if len(rows) == 0:
            return cls(np.zeros((0, 0), dtype=np.bool_), 0, 0, width, height, label, score)
        y0, y1, x0, x1 = rows[0], rows[-1] + 1, cols[0], cols[-1] + 1
        crop = np.ascontiguousarray(bitmap[y0:y1, x0:x1]).astype(np.bool_)
        return cls(crop, int(x0), int(y0), width, height, label, score)

    def full(self) -> NDArray[np.bool_]:
        """Return the mask as an (height, width) bool image."""
        image = np.zeros((self.height, self.width), dtype=np.bool_)
        h, w = self.bitmap.shape
        image[self.y : self.y + h, self.x : self.x + w] = self.bitmap
        return image

    @property
    def area(self) -> int:
        """Return the number of set pixels."""
        return int(np.count_nonzero(self.bitmap))

    @property
    def box(self) -> tuple[int, int, int, int]:
        """Return x, y, w, h in pixels (COCO's bbox)."""
        h, w = self.bitmap.shape
        return self.x, self.y, w, h


MAX_SIDE = 65_535  # maximum of JPEG

# Larger than any phone's sensor (200 million) and the largest texture (16384 px squared).
MAX_PIXELS = 280_000_000


def check_picture_size(width: int, height: int) -> None:
    """Raise InputError for sizes beyond any phone's picture, because arrays are allocated by them.

    Raises
    ------
    InputError : a side is not positive, or the size exceeds `MAX_SIDE` or `MAX_PIXELS`.
    """
    if width <= 0 or height <= 0:
        raise InputError(f"picture size must be positive, got {width}x{height}")
    if max(width, height) > MAX_SIDE or width * height > MAX_PIXELS:
        raise InputError(
            f"a picture of {width}x{height} is too large; "
            f"at most {MAX_SIDE} a side and {MAX_PIXELS // 10**6} megapixels"
        )


# Number of parameters of each model; the comments list them in COLMAP's order.
CAMERA_MODELS = {
    "SIMPLE_PINHOLE": 3,  # f, cx, cy
    "PINHOLE": 4,  # fx, fy, cx, cy
    "SIMPLE_RADIAL": 4,  # f, cx, cy, k1
    "RADIAL": 5,  # f, cx, cy, k1, k2
    "OPENCV": 8,  # fx, fy, cx, cy, k1, k2, p1, p2
    "FULL_OPENCV": 12,  # fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6
    "OPENCV_FISHEYE": 8,  # fx, fy, cx, cy, k1, k2, k3, k4
}
_ONE_FOCAL = {"SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"}


def _radial(uv: Floats, k: tuple[float, ...]) -> Floats:
    r2 = (uv**2).sum(axis=-1, keepdims=True)
    factor = np.ones_like(r2)
    for power, coefficient in enumerate(k, start=1):
        factor = factor + coefficient * r2**power
    return uv * factor


def _opencv(uv: Floats, k: tuple[float, ...]) -> Floats:
    k1, k2, p1, p2, *higher = k
    k3, k4, k5, k6 = higher or (0.0, 0.0, 0.0, 0.0)
    u, v = uv[..., 0], uv[..., 1]
    r2 = u * u + v * v
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    du = 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
    dv = 2 * p2 * u * v + p1 * (r2 + 2 * v * v)
    return np.stack([u * radial + du, v * radial + dv], axis=-1)


def _fisheye(uv: Floats, k: tuple[float, ...]) -> Floats:
    radius = np.sqrt((uv**2).sum(axis=-1, keepdims=True))
    theta = np.arctan(radius)
    t2 = theta**2
    distorted = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))))
    small = radius < 1e-12
    return uv * np.where(small, 1.0, distorted / np.where(small, 1.0, radius))


_DISTORT: dict[str, Callable[[Floats, tuple[float, ...]], Floats]] = {
    "SIMPLE_RADIAL": _radial,
    "RADIAL": _radial,
    "OPENCV": _opencv,
    "FULL_OPENCV": _opencv,
    "OPENCV_FISHEYE": _fisheye,
}


@dataclass(frozen=True)
class Camera:
    """The intrinsics of a camera.

    Parameters
    ----------
    model : a key of `CAMERA_MODELS` (COLMAP's names).
    width, height : image size in pixels.
    params : parameters of the model in COLMAP's order, pixels and pure numbers.

    Examples
    --------
    A point 2 m ahead and 1 m to the right:

    >>> camera = Camera("PINHOLE", 640, 480, (520.0, 520.0, 320.0, 240.0))
    >>> camera.project([1.0, 0.0, 2.0]).tolist()
    [580.0, 240.0]
    """

    model: str
    width: int
    height: int
    params: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.model not in CAMERA_MODELS:
            raise InputError(
                f"camera model {self.model!r} is not supported; "
                f"expected one of {', '.join(CAMERA_MODELS)}",
                "Undistort the photos first (COLMAP's image_undistorter).",
            )
        expected = CAMERA_MODELS[self.model]
        if len(self.params) != expected:
            raise InputError(
                f"camera model {self.model} takes {expected} parameters, got {len(self.params)}"
            )
        check_picture_size(self.width, self.height)
        if not np.isfinite(self.params).all() or self.fx <= 0 or self.fy <= 0:
            raise InputError(f"camera parameters must be finite with a focal > 0: {self.params}")

    @property
    def fx(self) -> float:
        return self.params[0]

    @property
    def fy(self) -> float:
        return self.params[0] if self.model in _ONE_FOCAL else self.params[1]

    @property
    def cx(self) -> float:
        return self.params[1] if self.model in _ONE_FOCAL else self.params[2]

    @property
    def cy(self) -> float:
        return self.params[2] if self.model in _ONE_FOCAL else self.params[3]

    @property
    def distortion(self) -> tuple[float, ...]:
        """Return the distortion coefficients in COLMAP's order; empty for pinhole models."""
        return self.params[3:] if self.model in _ONE_FOCAL else self.params[4:]

    @property
    def is_pinhole(self) -> bool:
        """Return whether the lens has no distortion; a fisheye without coefficients has some."""
        return self.model != "OPENCV_FISHEYE" and not any(self.distortion)

    def matrix(self) -> Floats:
        """Return the (3, 3) calibration matrix K, without distortion."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], dtype=float)

    def pinhole(self) -> Camera:
        """Return the same camera without distortion, as for undistorted photos."""
        return Camera("PINHOLE", self.width, self.height, (self.fx, self.fy, self.cx, self.cy))

    def scaled(self, factor_x: float, factor_y: float | None = None) -> Camera:
        """Return the camera of a photo resized by the factors (sizes are rounded)."""
        fy = factor_x if factor_y is None else factor_y
        width, height = round(self.width * factor_x), round(self.height * fy)
        sx, sy = width / self.width, height / self.height
        params = list(self.params)
        if self.model in _ONE_FOCAL:
            params[0:3] = [params[0] * sx, params[1] * sx, params[2] * sy]
        else:
            params[0:4] = [params[0] * sx, params[1] * sy, params[2] * sx, params[3] * sy]
        return Camera(self.model, width, height, tuple(params))

    def project(self, points: Floats) -> Floats:
        """Return the pixels of points in the camera frame.

        Parameters
        ----------
        points : (..., 3) float, camera frame (x right, y down, z forward), metres.

        Returns
        -------
        (..., 2) float, pixels; NaN where z <= 0 (behind the camera).
        """
        points = np.asarray(points, dtype=np.float64)
        z = points[..., 2:3]
        ahead = z > 0
        uv = points[..., :2] / np.where(ahead, z, 1.0)
        if self.model in _DISTORT and not self.is_pinhole:
            uv = _DISTORT[self.model](uv, self.distortion)
        pixels = uv * np.array([self.fx, self.fy]) + np.array([self.cx, self.cy])
        return np.where(ahead, pixels, np.nan)
