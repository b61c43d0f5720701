"""Memory of ingest on the largest phone photos, and on photos beyond any phone.

    python -m benchmarks.ingest_memory            # makes its inputs: some minutes
    python -m benchmarks.ingest_memory --only jpeg108 heic200 --keep FOLDER

Memory is the resident sum over the processes of a scan, sampled every 10 ms (Linux). Encoding the
HEIC takes two minutes. To measure another version of walltopo, put its `src` on PYTHONPATH.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

PAGE_BYTES = 4096


def blocks(seed: int, size: tuple[int, int], side: int) -> Image.Image:
    """Return a sharp picture of random blocks."""
    generator = np.random.default_rng(seed)
    shape = (-(-size[1] // side), -(-size[0] // side), 3)
    colours = generator.integers(0, 255, shape, dtype=np.uint8)
    return Image.fromarray(colours).resize(size, Image.Resampling.NEAREST)


def make_png(folder: Path) -> None:
    for k in range(4):
        blocks(k, (13_300, 13_300), 700).save(folder / f"p{k}.png")


def make_jpeg108(folder: Path) -> None:
    for k in range(6):
        blocks(10 + k, (12_000, 9000), 100).save(folder / f"p{k}.jpg", quality=90)


def make_jpeg200(folder: Path) -> None:
    for k in range(3):
        blocks(20 + k, (16_320, 12_240), 100).save(folder / f"p{k}.jpg", quality=90)


def make_heic200(folder: Path) -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()
    for k in range(3):
        blocks(40 + k, (4080, 3060), 100).save(folder / f"s{k}.jpg")
    # Phones write tiles of 512 pixels.
    blocks(30, (16_320, 12_240), 100).save(folder / "p0.heic", quality=50, tile_size=512)


def make_film(folder: Path) -> None:
    import av

    width, height, frames = 3840, 2160, 1500
    wide = np.asarray(blocks(50, (3 * width, height), 60))
    with av.open(str(folder / "walk.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=30, options={"preset": "ultrafast"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for k in range(frames):
            x = int((1 - abs(1 - 2 * k / frames)) * 2 * width)
            pixels = np.ascontiguousarray(wide[:, x : x + width])
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, "rgb24")))
        container.mux(stream.encode())


INPUTS: dict[str, tuple[str, Callable[[Path], None]]] = {
    "png": ("4 PNGs of 13,300 x 13,300", make_png),
    "jpeg108": ("6 JPEGs of 108 megapixels", make_jpeg108),
    "jpeg200": ("3 JPEGs of 200 megapixels", make_jpeg200),
    "heic200": ("a HEIC of 200 megapixels, 3 JPEGs of 12", make_heic200),
    "film": ("50 s of 4K film", make_film),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=INPUTS, default=list(INPUTS))
    parser.add_argument("--photos", type=Path, nargs="*", default=[], help="folders to add")
    parser.add_argument("--keep", type=Path, help="keep the inputs here, and use what is there")
    args = parser.parse_args()
    print("| input | photos | peak |\n|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as temporary:
        for name in args.only:
            folder = (args.keep or Path(temporary)) / name
            if not folder.is_dir():
                folder.mkdir(parents=True)
                INPUTS[name][1](folder)
            print(row(INPUTS[name][0], folder, Path(temporary)), flush=True)
        for folder in args.photos:
            print(row(str(folder), folder, Path(temporary)), flush=True)


def row(title: str, photos: Path, temporary: Path) -> str:
    """Scan up to ingest in a child process; return one line of the table."""
    with tempfile.TemporaryDirectory(dir=temporary) as out:
        command = [sys.executable, "-m", "walltopo", "scan", str(photos), "-o", out]
        peak = 0
        scan = subprocess.Popen([*command, "--to", "ingest", "-q"])
        while scan.poll() is None:
            peak = max(peak, sum(resident(process) for process in family(scan.pid)))
            time.sleep(0.01)
        stored = len(list((Path(out) / "photos").glob("*.jpg")))
    return f"| {title} | {stored} | {peak / 2**20:,.0f} MiB |"


def family(process: int) -> list[int]:
    """Return a process and all its descendants."""
    found = [process]
    for children in Path(f"/proc/{process}/task").glob("*/children"):
        try:
            born = children.read_text().split()
        except OSError:
            continue
        for child in born:
            found += family(int(child))
    return found


def resident(process: int) -> int:
    """Return the process's bytes in memory; 0 after its end."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * PAGE_BYTES
    except (OSError, IndexError):
        return 0


if __name__ == "__main__":
    main()
