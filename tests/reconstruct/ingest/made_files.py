"""Pictures and films for the tests of ingest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from walltopo.pipeline.runner import run_stage, write_sources
from walltopo.reconstruct.settings import IngestSettings
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import PhotoList


def picture(seed: int, size: tuple[int, int] = (640, 480), block: int = 10) -> Image.Image:
    """A sharp picture of coarse random blocks, another for every seed."""
    generator = np.random.default_rng(seed)
    rows, columns = -(-size[1] // block), -(-size[0] // block)
    blocks = generator.integers(0, 255, (rows, columns, 3), dtype=np.uint8)
    return (
        Image.fromarray(blocks)
        .resize((columns * block, rows * block), Image.Resampling.NEAREST)
        .crop((0, 0, *size))
    )


def write_photos(folder: Path, count: int = 3) -> None:
    folder.mkdir(exist_ok=True)
    for k in range(count):
        picture(k).save(folder / f"p{k}.jpg", quality=92)


def write_film(
    path: Path, frames: int, size: tuple[int, int] = (640, 480), step: int = 16, rate: int = 30
) -> None:
    """A camera that walks along a wall of blocks by `step` pixels a frame, to and fro."""
    import av

    far = 2400
    wide = np.asarray(picture(0, (far + size[0], size[1])))
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=rate)
        stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        for k in range(frames):
            x = far - abs(far - k * step % (2 * far))
            pixels = np.ascontiguousarray(wide[:, x : x + size[0]])
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, "rgb24")))
        container.mux(stream.encode())


def ingested(tmp_path: Path, *sources: Path, **settings: float) -> ScanFolder:
    scan = ScanFolder(tmp_path / "scan")
    write_sources(scan, sources)
    run_stage(scan, "ingest", IngestSettings(**settings))  # type: ignore[arg-type]
    return scan


def skipped_reasons(scan: ScanFolder) -> dict[str, str]:
    return {item.source: item.reason for item in PhotoList.load(scan.photo_list).skipped}
