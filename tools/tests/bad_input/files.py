"""Contents of the files that make an input bad."""

from __future__ import annotations

import json
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

Write = Callable[[Path], object]
# A file's text or bytes, or a function that makes or changes the file.
Files = Mapping[str, str | bytes | Write]


def picture(seed: int, size: tuple[int, int] = (640, 480)) -> Image.Image:
    """Return a sharp picture of random blocks, different for every seed."""
    generator = np.random.default_rng(seed)
    blocks = generator.integers(0, 255, (size[1] // 8, size[0] // 8, 3), dtype=np.uint8)
    return Image.fromarray(blocks).resize(size, Image.Resampling.NEAREST)


def image(
    seed: int = 8, size: tuple[int, int] = (640, 480), kind: str | None = None, **options: Any
) -> Write:
    """Return a picture in the format `kind`, by default that of the file's name."""
    return lambda path: picture(seed, size).save(path, kind, **options)


def plain(mode: str, size: tuple[int, int], colour: Any = 0) -> Write:
    """Return a picture of one colour."""
    return lambda path: Image.new(mode, size, colour).save(path)


def cmyk(path: Path) -> None:
    picture(8).convert("CMYK").save(path)


def grey_16_bit(path: Path) -> None:
    Image.fromarray(np.asarray(picture(8).convert("L")).astype(np.uint16) * 257).save(path)


def small_preview(seed: int) -> Write:
    """Return a small TIFF of the picture that `image(seed, (1280, 960))` shows."""
    return lambda path: picture(seed, (1280, 960)).resize((640, 480)).save(path, "TIFF")


def film(path: Path) -> None:
    """Write a second of film that begins with the picture of seed 0."""
    import av

    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for number in range(30):
            pixels = np.roll(np.asarray(picture(0)), 8 * number, axis=1)
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), "rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def cut(share: int) -> Write:
    """Return a function that keeps one part in `share` of a file."""
    return lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // share])


def half(whole: Write) -> Write:
    """Return the first half of a file that `whole` writes."""

    def write(path: Path) -> None:
        import pillow_heif

        pillow_heif.register_heif_opener()
        whole(path)
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    return write


def huge_png(path: Path) -> None:
    """Write the header of 250 megapixels; ingest rejects the file before it decodes pixels."""
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", 15_900, 15_700, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(b"")),
        (b"IEND", b""),
    )
    with path.open("wb") as stream:
        stream.write(b"\x89PNG\r\n\x1a\n")
        for name, body in chunks:
            stream.write(struct.pack(">I", len(body)) + name + body)
            stream.write(struct.pack(">I", zlib.crc32(name + body)))


def archive(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as out:
        out.write(path.with_name("p0.jpg"), "p0.jpg")


def link(target: str) -> Write:
    return lambda path: path.symlink_to(target)


def renamed(name: str) -> Write:
    return lambda path: path.rename(path.with_name(name))


def scan_and_damage(photos: Path) -> None:
    """Scan the photos to ingest, then cut off a photo of the scan."""
    from walltopo.pipeline.runner import scan

    folder = photos.with_name("scan")
    scan(photos, folder, to_stage="ingest")
    photo = next((folder / "photos").iterdir())
    photo.write_bytes(photo.read_bytes()[:1000])


def scan_damage_and_move(photos: Path) -> None:
    scan_and_damage(photos)
    photos.rename(photos.with_name("elsewhere"))


def cut_model(size: int) -> Write:
    """Return the first bytes of a file of a binary COLMAP model, whose other files are whole."""

    def write(path: Path) -> None:
        from walltopo.geometry.colmap import pycolmap

        options = pycolmap.SyntheticDatasetOptions(
            num_rigs=1, num_cameras_per_rig=1, num_frames_per_rig=3, num_points3D=4
        )
        pycolmap.synthesize_dataset(options).write_binary(path.parent)
        path.write_bytes(path.read_bytes()[:size])

    return write


def coco(file_name: str = "a.png", category_id: int = 1, segmentation: Any = None) -> Files:
    """Return a photo of 20x18 pixels and a COCO file with one annotation of it."""
    photo = {"id": 1, "file_name": file_name, "width": 20, "height": 18}
    outline = segmentation or [[2, 2, 9, 2, 9, 9, 2, 9]]
    row = {"id": 1, "image_id": 1, "category_id": category_id, "segmentation": outline}
    labels = {"images": [photo], "categories": [{"id": 1, "name": "hold"}], "annotations": [row]}
    return {"a.png": image(0, (20, 18)), "labels.json": json.dumps(labels)}


UPRIGHT = ((1.0, 0, 0, 0), (0, 1.0, 0, 0), (0, 0, 1.0, 0), (0, 0, 0, 1.0))
MIRRORED = ((-1.0, 0, 0, 0), *UPRIGHT[1:])
SHEARED = ((1.0, 0.5, 0, 0), *UPRIGHT[1:])
FAR = ((1.0, 0, 0, 2e9), *UPRIGHT[1:])


def frames(names: Iterable[str], matrix: Any = UPRIGHT, **lens: Any) -> str:
    """Return a `transforms.json` of nerfstudio with one pose for all names."""
    camera = {"w": 640, "h": 480, "fl_x": 500, "fl_y": 500, "cx": 320, "cy": 240, **lens}
    poses = [{"file_path": name, "transform_matrix": matrix} for name in names]
    return json.dumps({**camera, "frames": poses})


def lift_scene(
    cameras: tuple[str, ...] = ("0.jpg", "1.jpg"),
    photos: tuple[str, ...] = ("0.jpg", "1.jpg"),
    masks_size: tuple[int, int] = (128, 96),
    segmentation: Any = ((50, 40, 70, 40, 70, 60, 50, 60),),
    scale: float = 1.0,
    shift: float = 0.0,
    **lens: Any,
) -> Files:
    """Return a plate of 2 m, two cameras 2 m in front of it and a mask in each photo."""
    poses = []
    for number, name in enumerate(cameras):
        pose = np.eye(4)
        pose[:3, 3] = 0.2 * number, 0, 2
        poses.append({"file_path": name, "transform_matrix": pose.tolist()})
    width, height = masks_size
    labels = {
        "images": [
            {"id": k, "file_name": name, "width": width, "height": height}
            for k, name in enumerate(photos)
        ],
        "annotations": [
            {"id": k, "image_id": k, "category_id": 1, "segmentation": segmentation}
            for k in range(len(photos))
        ],
        "categories": [{"id": 1, "name": "hold"}],
    }
    corners = [
        f"v {scale * x + shift} {scale * y} 0\n" for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return {
        "transforms.json": json.dumps({"w": 128, "h": 96, "fl_x": 100.0, "frames": poses} | lens),
        "masks.json": json.dumps(labels),
        "wall.obj": "".join(corners) + "f 1 2 3 4\n",
    }
