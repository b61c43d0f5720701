"""The table of docs/bad-input.md: the exit code and the output for every kind of bad input.

    python -m benchmarks.bad_input > docs/bad-input.md

Each case has a function that makes it, and the message that the user must get. The product's tests
run every case.
"""

from __future__ import annotations

import io
import json
import os
import re
import struct
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.bad_lift import LIFT_CASES
from benchmarks.bad_photos import PHOTO_CASES
from benchmarks.bad_pictures import photos_in, picture, scan_of
from benchmarks.bad_platform import PLATFORM_HEAD, platform_rows
from benchmarks.bad_poses import POSE_CASES
from walltopo.pipeline.runner import scan

HEAD = """\
# What happens with bad input

Written by `make docs` (`python -m benchmarks.bad_input`); the tests run every row. Exit codes:
0 done, 2 usage or settings, 3 the input, 4 no result from usable input, 5 the machine.

| given | exit | output |
|---|---|---|
"""


@dataclass(frozen=True)
class Case:
    """One kind of bad (or merely unusual) input.

    Parameters
    ----------
    name : the input, as named in the table.
    make : fills a folder and returns the arguments after `walltopo` and the command.
    code : the exit code expected.
    says : text that the output must contain.
    command : subcommand of `walltopo` to run.
    """

    name: str
    make: Callable[[Path], list[str]]
    code: int
    says: str
    command: str = "scan"


def _empty(root: Path) -> list[str]:
    (root / "in").mkdir()
    return scan_of(root / "in")


def _missing(root: Path) -> list[str]:
    return scan_of(root / "nowhere")


def _text(root: Path) -> list[str]:
    folder = photos_in(root / "in", 2)
    (folder / "note.jpg").write_text("dear diary")
    return scan_of(folder)


def _truncated(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    data = (folder / "p0.jpg").read_bytes()
    (folder / "p0.jpg").write_bytes(data[: len(data) // 3])
    return scan_of(folder)


def _zero_bytes(root: Path) -> list[str]:
    folder = photos_in(root / "in", 2)
    (folder / "empty.jpg").touch()
    return scan_of(folder)


def _deep_png(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    deep = np.asarray(picture(8).convert("L")).astype(np.uint16) * 257
    Image.fromarray(deep).save(folder / "deep.png")
    return scan_of(folder)


def _cmyk(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    picture(8).convert("CMYK").save(folder / "print.jpg")
    return scan_of(folder)


def _one_photo(root: Path) -> list[str]:
    return scan_of(photos_in(root / "in", 1))


def _alike(root: Path) -> list[str]:
    folder = root / "in"
    folder.mkdir()
    for k in range(5):
        picture(0).save(folder / f"same{k}.jpg", quality=80 + k)
    return scan_of(folder)


def _tiny(root: Path) -> list[str]:
    folder = root / "in"
    folder.mkdir()
    for k in range(4):
        picture(k, (160, 120)).save(folder / f"thumb{k}.png")
    return scan_of(folder)


def _blank(root: Path) -> list[str]:
    folder = root / "in"
    folder.mkdir()
    for k in range(4):
        Image.new("RGB", (640, 480), (40 * k, 90, 90)).save(folder / f"fog{k}.png")
    return scan_of(folder)


def _panorama(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    picture(8, (6000, 1000)).save(folder / "pano.png")
    return scan_of(folder)


def _bomb(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    Image.new("1", (40_000, 40_000)).save(folder / "bomb.png")
    return scan_of(folder)


def _spaces(root: Path) -> list[str]:
    return scan_of(photos_in(root / "Wände & Räume (neu) 🧗" / "mes photos"))


def _wrong_suffix(root: Path) -> list[str]:
    folder = photos_in(root / "in", 2)
    stream = io.BytesIO()
    picture(5).save(stream, "PNG")
    (folder / "really_png.jpg").write_bytes(stream.getvalue())
    return scan_of(folder)


def _film(root: Path) -> list[str]:
    folder = root / "in"
    folder.mkdir()
    (folder / "walk.mp4").write_bytes(np.random.default_rng(0).bytes(5000))
    return scan_of(folder)


def _other_files(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    (folder / "list.xlsx").write_text("x")
    (folder / "folder.jpg").mkdir()
    return scan_of(folder)


def _read_only(root: Path) -> list[str]:
    return [str(photos_in(root / "in")), "-o", "/proc/walltopo-scan", "--to", "ingest"]


def _out_is_file(root: Path) -> list[str]:
    (root / "scan").write_text("a file")
    return scan_of(photos_in(root / "in"))


def _foreign_folder(root: Path) -> list[str]:
    (root / "scan").mkdir()
    (root / "scan" / "holiday.txt").write_text("not a scan")
    return scan_of(photos_in(root / "in"))


def _damaged_manifest(root: Path) -> list[str]:
    (root / "scan").mkdir()
    (root / "scan" / "scan.json").write_text('{"version": 1, "stages"')
    return scan_of(photos_in(root / "in"))


def _unknown_setting(root: Path) -> list[str]:
    return scan_of(photos_in(root / "in"), "--set", "ingest.max_sid=100")


def _impossible_setting(root: Path) -> list[str]:
    return scan_of(photos_in(root / "in"), "--set", "ingest.max_side=-1")


def _unknown_stage(root: Path) -> list[str]:
    return scan_of(photos_in(root / "in"), to="meshing")


def _unrelated(root: Path) -> list[str]:
    return scan_of(photos_in(root / "in", 4), to="sparse")


def _no_reference(root: Path) -> list[str]:
    (root / "old").mkdir()
    return scan_of(photos_in(root / "in"), "--reference", str(root / "old"), to="sparse")


def _pipe_photo(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    os.mkfifo(folder / "pipe.jpg")
    return scan_of(folder)


def _links(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    (folder / "gone.jpg").symlink_to("moved-away.jpg")
    (folder / "round.jpg").symlink_to("round.jpg")
    return scan_of(folder)


def _cut_in_half(name: str) -> Callable[[Path], list[str]]:
    """Return a maker of a truncated picture in the format of `name`, under a suffix that ingest
    reads.
    """

    def make(root: Path) -> list[str]:
        import pillow_heif

        pillow_heif.register_heif_opener()
        folder = photos_in(root / "in")
        picture(8).save(root / name)
        data = (root / name).read_bytes()
        looked_at = name if name.endswith(".heic") else "photo.jpg"
        (folder / looked_at).write_bytes(data[: len(data) // 2])
        return scan_of(folder)

    return make


def _cut_film(root: Path) -> list[str]:
    import av

    folder = photos_in(root / "in")
    with av.open(str(root / "walk.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for k in range(10):
            container.mux(stream.encode(av.VideoFrame.from_image(picture(k))))
        container.mux(stream.encode())
    data = (root / "walk.mp4").read_bytes()
    (folder / "walk.mp4").write_bytes(data[: len(data) // 2])
    return scan_of(folder)


def _postscript(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    (folder / "drawing.jpg").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n")
    return scan_of(folder)


def _gif(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    stream = io.BytesIO()
    picture(8).save(stream, "GIF")
    (folder / "moving.jpg").write_bytes(stream.getvalue())
    return scan_of(folder)


def _odd_names(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    (folder / "p0.jpg").rename(folder / os.fsdecode(b"caf\xe9.jpg"))
    (folder / "p1.jpg").rename(folder / ("ü" * 125 + ".jpg"))
    return scan_of(folder)


def _odd_folder(root: Path) -> list[str]:
    folder = photos_in(root / "in").rename(root / os.fsdecode(b"caf\xe9"))
    return [str(folder), "-o", str(folder) + "-scan", "--to", "ingest"]


def _huge_png(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    # The header is enough: ingest rejects the file before it decodes pixels.
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", 15_900, 15_700, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(b"")),
        (b"IEND", b""),
    )
    with (folder / "huge.png").open("wb") as stream:
        stream.write(b"\x89PNG\r\n\x1a\n")
        for name, body in chunks:
            stream.write(struct.pack(">I", len(body)) + name + body)
            stream.write(struct.pack(">I", zlib.crc32(name + body)))
    return scan_of(folder)


def _scan_among_photos(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    (folder / "wall").mkdir()
    (folder / "wall" / "scan.json").write_text("{}")
    return scan_of(folder)


def _scan_as_photos(root: Path) -> list[str]:
    folder = photos_in(root / "in")
    (folder / "scan.json").write_text("{}")
    return scan_of(folder)


def _damaged_since(root: Path) -> list[str]:
    again = scan_of(photos_in(root / "in"))
    scan(root / "in", root / "scan", to_stage="ingest")
    photo = next((root / "scan" / "photos").iterdir())
    photo.write_bytes(photo.read_bytes()[:1000])
    return again


def _damaged_and_moved(root: Path) -> list[str]:
    again = _damaged_since(root)
    (root / "in").rename(root / "elsewhere")
    return again[1:]


HEALING_CASES = (
    Case("a stored photo cut off since", _damaged_since, 0, "was changed since ingest wrote it"),
    Case("the same, and its original gone", _damaged_and_moved, 3, "was deleted after the scan"),
)

INGEST_CASES = (
    Case("a pipe among the photos", _pipe_photo, 0, "skipped pipe.jpg: a pipe, not a file"),
    Case("links to nothing and in a circle", _links, 0, "a link that leads in a circle"),
    Case("half a HEIC", _cut_in_half("photo.heic"), 0, "skipped photo.heic: "),
    Case("half an AVIF named .jpg", _cut_in_half("photo.avif"), 0, "skipped photo.jpg: "),
    Case("half a WebP named .jpg", _cut_in_half("photo.webp"), 0, "skipped photo.jpg: "),
    Case("half a film", _cut_film, 0, "cannot be decoded as a video"),
    Case("PostScript named .jpg", _postscript, 0, "not an image that is read here"),
    Case("a GIF named .jpg", _gif, 0, "not an image that is read here"),
    Case("names that are not UTF-8, and of 254 bytes", _odd_names, 0, "photos 3, skipped 0"),
    Case("folders whose names are not UTF-8", _odd_folder, 0, "photos 3, skipped 0"),
    Case("a PNG of 250 megapixels", _huge_png, 0, "MiB of memory, more than"),
    Case("a scan in the folder of photos", _scan_among_photos, 0, "skipped wall: a scan folder"),
    Case("a scan folder in place of photos", _scan_as_photos, 3, "is a scan folder, not a folder"),
)


def _view(*more: str) -> Callable[[Path], list[str]]:
    """Return a maker of a scan with a page, for `view` with some options."""

    def make(root: Path) -> list[str]:
        (root / "scan").mkdir()
        (root / "scan" / "index.html").touch()
        return [str(root / "scan"), *more]

    return make


# Only the `view` cases that end by themselves; docs/security.md covers a running server.
VIEW_CASES = (
    Case(
        "`view` of what has no page",
        lambda root: [str(root / "scan")],
        3,
        "no page to show",
        "view",
    ),
    Case("`view --port 99999`", _view("--port", "99999"), 2, "65535", "view"),
    Case("`view --port -1`", _view("--port", "-1"), 2, "-1", "view"),
    Case("`view --host 0.0.0.0`", _view("--host", "0.0.0.0"), 2, "every address", "view"),
    Case(
        "`view --host` of another machine",
        _view("--host", "192.0.2.1", "--port", "0"),
        2,
        "not an address of this machine",
        "view",
    ),
    Case("`view --embed` of no origin", _view("--embed", "gym"), 2, "is not an origin", "view"),
)

CASES: tuple[Case, ...] = (
    Case("a folder without photos", _empty, 3, "no photos here"),
    Case("a path that does not exist", _missing, 3, "no such file or folder"),
    Case("a text file named .jpg", _text, 3, "not an image that is read here"),
    Case("a truncated JPEG among too few", _truncated, 3, "damaged or cut off"),
    Case("a file of zero bytes", _zero_bytes, 3, "not an image"),
    Case("a 16-bit grey PNG", _deep_png, 0, "photos 4, skipped 0"),
    Case("a CMYK JPEG", _cmyk, 0, "photos 4, skipped 0"),
    Case("a PNG named .jpg", _wrong_suffix, 0, "photos 3, skipped 0"),
    Case("one photo", _one_photo, 3, "1 usable photo, at least 3 are needed"),
    Case("the same photo five times", _alike, 3, "shows the same as same4.jpg"),
    Case("thumbnails", _tiny, 3, "smaller than 320 px"),
    Case("photos of fog", _blank, 3, "blurred"),
    Case("a panorama among photos", _panorama, 0, "a panorama; it has no single camera"),
    Case("a picture of 1.6 gigapixels", _bomb, 0, "too large to be a phone photo"),
    Case("spaces, umlauts and emoji in paths", _spaces, 0, "photos 3"),
    Case("noise named .mp4", _film, 3, "cannot be decoded as a video"),
    Case("other files among the photos", _other_files, 0, "neither a photo nor a video"),
    Case("an output folder that cannot be made", _read_only, 5, "cannot create"),
    Case("an output that is a file", _out_is_file, 3, "is a file, expected a folder"),
    Case("an output folder with other things", _foreign_folder, 3, "not a scan folder"),
    Case("a damaged scan.json", _damaged_manifest, 3, "not valid JSON"),
    Case("an unknown setting", _unknown_setting, 2, "Did you mean ingest.max_side?"),
    Case("an impossible setting", _impossible_setting, 2, "expected at least 640, got -1"),
    Case("an unknown stage", _unknown_stage, 3, "unknown stage 'meshing'"),
    Case("photos that show nothing in common", _unrelated, 4, "could be registered"),
    Case("a reference that is no scan", _no_reference, 3, "has no cameras"),
    *INGEST_CASES,
    *HEALING_CASES,
    *VIEW_CASES,
)


# Cases of output paths and of typed arguments.


def _finished(root: Path) -> Path:
    """Write the minimum that makes a folder a scan."""
    scan = root / "gym"
    scan.mkdir()
    (scan / "scan.json").write_text('{"version": 1, "stages": {}}')
    return scan


def _export_to(where: str, *more: str) -> Callable[[Path], list[str]]:
    return lambda root: [str(_finished(root)), "-o", str(root / where), *more]


def _merge_to(where: str, *more: str) -> Callable[[Path], list[str]]:
    def make(root: Path) -> list[str]:
        (root / "site").mkdir()
        (root / "site" / "index.html").write_text("mine")
        scan = str(_finished(root))
        return [scan, scan, "--same-frame", "-o", str(root / where), *more]

    return make


def _taken(root: Path) -> list[str]:
    (root / "plate.pdf").write_text("mine")
    return ["print", "-o", str(root / "plate.pdf")]


def _pipe(root: Path) -> list[str]:
    os.mkfifo(root / "pipe")
    return ["print", "-o", str(root / "pipe"), "--overwrite"]


def _backup(place: str, to: str, *more: str) -> Callable[[Path], list[str]]:
    """Return a maker of `gym backup` arguments; the gym in `root/gym` has an empty database."""

    def make(root: Path) -> list[str]:
        (root / "gym").mkdir()
        (root / "gym" / "gym.sqlite").touch()
        (root / "there.tar").write_text("mine")
        return ["backup", "--data", str(root / place), str(root / to), *more]

    return make


def _config(content: bytes | None) -> Callable[[Path], list[str]]:
    def make(root: Path) -> list[str]:
        config = root / "settings"
        if content is None:
            config.mkdir()
        else:
            config.write_bytes(content)
        return scan_of(root / "in", "--config", str(config))

    return make


def _notepad(encoding: str) -> Callable[[Path], list[str]]:
    def make(root: Path) -> list[str]:
        (root / "settings.toml").write_text("[ingest]\nmax_side = 1280\n", encoding)
        return scan_of(photos_in(root / "in"), "--config", str(root / "settings.toml"))

    return make


OUTPUT_CASES = (
    Case(
        "`export -o` into the scan itself",
        _export_to("gym", "--format", "labelme", "--overwrite"),
        3,
        "belongs to the scan",
        "export",
    ),
    Case("`export -o` a file of the scan", _export_to("gym/mesh.ply"), 3, "belongs to", "export"),
    Case("`merge -o` a web site's folder", _merge_to("site"), 3, "is not empty", "merge"),
    Case("`merge -o` another scan", _merge_to("gym", "--overwrite"), 3, "belongs to", "merge"),
    Case("`-o` a file that is there", _taken, 3, "is there already", "measure"),
    Case("`gym backup` of no gym", _backup("gmy", "b.tar"), 3, "no gym there", "gym"),
    Case("`gym backup` onto a file", _backup("gym", "there.tar"), 3, "is there already", "gym"),
    Case(
        "`gym backup` onto the gym",
        _backup("gym", "gym/gym.sqlite", "--overwrite"),
        3,
        "belongs to the gym itself",
        "gym",
    ),
    Case("`-o` a named pipe", _pipe, 3, "no file can replace it", "measure"),
    Case(
        "`-o` a device",
        lambda _: ["print", "-o", "/dev/null", "--overwrite"],
        3,
        "no file can replace it",
        "measure",
    ),
    Case("`merge --near nan`", _merge_to("new", "--near", "nan"), 2, "a finite number", "merge"),
    Case("`merge --near -1`", _merge_to("new", "--near", "-1"), 2, "at least 0.001", "merge"),
    Case("a settings file that is a folder", _config(None), 3, "cannot be read"),
    Case("settings 100,000 deep", _config(b"a = " + b"[" * 100_000), 3, "nested too deeply"),
    Case("a setting of 5,000 digits", _config(b"a = " + b"9" * 5000), 3, "not valid TOML"),
    Case("settings as Windows Notepad saves them", _notepad("utf-16"), 0, "photos 3"),
    Case("settings with a byte-order mark", _notepad("utf-8-sig"), 0, "photos 3"),
    Case("settings that are not UTF-8", _config(b"\xff"), 3, "not valid TOML"),
    Case(
        "a path with escape codes and markup",
        lambda root: [str(root / "\x1b[31m[/red]")],
        3,
        r"\x1b[31m[/red]: not a scan folder",
        "status",
    ),
)
CASES += OUTPUT_CASES


# Cases of files from other programs.

_SQUARE = [2, 2, 9, 2, 9, 9, 2, 9]


def _labels(root: Path, **changes: object) -> list[str]:
    """Write a COCO file of one photo with changed fields; return the arguments to convert it."""
    picture(0, (20, 18)).save(root / "a.png")
    image = {"id": 1, "file_name": "a.png", "width": 20, "height": 18}
    row = {"id": 1, "image_id": 1, "category_id": 1, "segmentation": [_SQUARE]}
    for entry in (image, row):
        entry.update((key, value) for key, value in changes.items() if key in entry)
    data = {"images": [image], "categories": [{"id": 1, "name": "hold"}], "annotations": [row]}
    (root / "labels.json").write_text(json.dumps(data))
    return ["convert", str(root / "labels.json"), str(root / "to"), "--to", "coco"]


def _converted(**changes: object) -> Callable[[Path], list[str]]:
    return lambda root: _labels(root, **changes)


def _label_file(name: str, text: str) -> Callable[[Path], list[str]]:
    def make(root: Path) -> list[str]:
        (root / name).write_text(text)
        return ["convert", str(root / name), str(root / "to"), "--to", "coco"]

    return make


def _mesh(content: bytes) -> Callable[[Path], list[str]]:
    def make(root: Path) -> list[str]:
        (root / "m.ply").write_bytes(content)
        return ["check", str(root / "m.ply")]

    return make


def _cut_model(name: str, size: int) -> Callable[[Path], list[str]]:
    def make(root: Path) -> list[str]:
        from walltopo.geometry.colmap import pycolmap

        options = pycolmap.SyntheticDatasetOptions(
            num_rigs=1, num_cameras_per_rig=1, num_frames_per_rig=3, num_points3D=4
        )
        pycolmap.synthesize_dataset(options).write_binary(root)
        (root / name).write_bytes((root / name).read_bytes()[:size])
        (root / "masks.json").write_text('{"images": [], "categories": [], "annotations": []}')
        return [
            "--mesh",
            "none.ply",
            "--cameras",
            str(root),
            "--masks",
            str(root / "masks.json"),
            "-o",
            str(root / "out"),
        ]

    return make


def _mirrored(root: Path) -> list[str]:
    matrix = [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]
    frames = [{"file_path": "a.jpg", "transform_matrix": matrix}]
    cameras = {"w": 96, "h": 72, "fl_x": 80.0, "frames": frames}
    (root / "transforms.json").write_text(json.dumps(cameras))
    (root / "masks.json").write_text('{"images": [], "categories": [], "annotations": []}')
    return [
        "--mesh",
        "none.ply",
        "--cameras",
        str(root / "transforms.json"),
        "--masks",
        str(root / "masks.json"),
        "-o",
        str(root / "out"),
    ]


_PLY = b"ply\nformat ascii 1.0\nelement vertex 2000000000\nproperty float x\nend_header\n"
_RLE = {"size": [2**31, 2**31], "counts": [0]}

READER_CASES = (
    Case(
        "labels: a photo named `../a.png`",
        _converted(file_name="../a.png"),
        3,
        "leads out of its folder",
        "dataset",
    ),
    Case(
        "labels: a photo named `/etc/passwd`",
        _converted(file_name="/etc/passwd"),
        3,
        "leads out of its folder",
        "dataset",
    ),
    Case(
        "labels: a polygon at 1e300",
        _converted(segmentation=[[1e300, 1, 5, 5, 9, 9]]),
        3,
        "far outside the picture",
        "dataset",
    ),
    Case(
        "labels: a polygon of five numbers",
        _converted(segmentation=[[1, 2, 3, 4, 5]]),
        3,
        "an odd number",
        "dataset",
    ),
    Case(
        "labels: RLE of 2^31 pixels a side",
        _converted(segmentation=_RLE),
        3,
        "segmentation.size",
        "dataset",
    ),
    Case(
        "labels: an unknown category",
        _converted(category_id=9),
        3,
        "there is no category 9",
        "dataset",
    ),
    Case(
        "labels: a number where a list is meant",
        _converted(segmentation=7),
        3,
        "segmentation",
        "dataset",
    ),
    Case(
        "labels: LabelMe with lines alone",
        _label_file(
            "a.json",
            '{"imagePath": "a.png", "imageWidth": 20, "imageHeight": 18, "shapes": '
            '[{"label": "x", "shape_type": "line", "points": [[1, 1], [5, 5]]}]}',
        ),
        3,
        "none of its shapes is understood: 1 of 'line'",
        "dataset",
    ),
    Case(
        "labels: CVAT's own XML",
        _label_file("annotations.xml", "<annotations><version>1.1</version></annotations>"),
        3,
        "COCO 1.0",
        "dataset",
    ),
    Case(
        "labels: Label Studio's own JSON",
        _label_file("studio.json", '[{"id": 1, "annotations": [], "data": {}}]'),
        3,
        "Label Studio's own JSON is not read",
        "dataset",
    ),
    Case(
        "a PLY that claims two billion vertices",
        _mesh(_PLY),
        3,
        "it declares 2000000000 entries",
        "mesh",
    ),
    Case(
        "a `frames.bin` of 45 bytes",
        _cut_model("frames.bin", 45),
        3,
        "frames.bin: truncated or damaged",
        "lift",
    ),
    Case(
        "a `cameras.bin` cut short",
        _cut_model("cameras.bin", 40),
        3,
        "cameras.bin: truncated or damaged",
        "lift",
    ),
    Case("a mirrored `transform_matrix`", _mirrored, 3, "frame 0: the pose mirrors", "lift"),
)
CASES += READER_CASES
CASES += tuple(Case(name, make, 3, says, "lift") for name, make, says in LIFT_CASES)
CASES += tuple(Case(name, make, 0, says) for name, make, says in PHOTO_CASES)
CASES += tuple(Case(*case) for case in POSE_CASES)


# Cases that need something absent from this machine or this scan.


def _late(*setting: str) -> Callable[[Path], list[str]]:
    """Return a maker of a whole scan of good photos with changed settings."""
    return lambda root: scan_of(photos_in(root / "in"), "--set", *setting, to="export")


def _page_there(root: Path) -> list[str]:
    (root / "wall.html").write_text("mine")
    return [str(_finished(root)), "--format", "page", "-o", str(root / "wall.html")]


def _site_there(root: Path) -> list[str]:
    (root / "web").mkdir()
    (root / "web" / "index.html").write_text("mine")
    return [str(_finished(root)), "--format", "site", "-o", str(root / "web")]


COMMAND_CASES = (
    Case(
        "OpenMVS asked for, and not here",
        _late("dense.openmvs_bin=/nowhere", "--set", "dense.backend=openmvs"),
        5,
        "not found in /nowhere",
    ),
    Case("a detector that is not there", _late("detect.model=nowhere.onnx"), 3, "nowhere.onnx"),
    Case("a detector of no name", _late("detect.model=yolo99"), 3, "neither a known detector"),
    Case("`export --format page` onto a file", _page_there, 3, "is there already", "export"),
    Case("`export --format site` into a web site", _site_there, 3, "is not empty", "export"),
    Case("a shell without completion", lambda _: ["csh"], 2, "invalid choice", "completion"),
)
CASES += COMMAND_CASES


def shown_output(output: str, root: Path) -> str:
    """Return the significant lines of an output, without this machine's folders."""
    text = output.replace(str(root), "").replace("/in/", "in/")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if lines and lines[0].startswith("usage:"):
        lines = lines[-1:]
    lines = [line for line in lines if not line.startswith("✗") and "(estimate)" not in line]
    lines = [re.sub(r"\s+[\d.]+ s$", "", line) for line in lines]
    # Keep the error, and at most one line of output before it.
    error = next((k for k, line in enumerate(lines) if line.startswith("error:")), 0)
    return " / ".join(lines[max(0, error - 1) :][:3]).replace("|", "\\|")


def row(case: Case) -> str:
    """Return the table row of one case."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        command = [sys.executable, "-m", "walltopo", case.command, *case.make(root)]
        done = subprocess.run(command, capture_output=True, text=True)
        return (
            f"| {case.name} | {done.returncode} | {shown_output(done.stdout + done.stderr, root)} |"
        )


def main() -> None:
    print(HEAD + "\n".join(row(case) for case in CASES))
    print(PLATFORM_HEAD + "\n".join(platform_rows()))


if __name__ == "__main__":
    main()
