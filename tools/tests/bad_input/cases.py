"""Bad and unusual inputs, each with the exit code and words of the output.

The tests run every case; `tools.tests.bad_input.page` writes docs/bad-input.md from the cases.
"""

from __future__ import annotations

import json
import os
import shlex
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from tools.tests.bad_input import files as f

INGEST = "scan ~/in -o ~/scan --to ingest"
CONFIG = f"{INGEST} --config ~/settings"
POSES = "scan ~/in -o ~/scan --to sparse --poses ~/poses"
EXPORT = "scan ~/in -o ~/scan --to export"
LABELS = "dataset convert ~/labels.json ~/to --to coco"
LIFT = "lift --mesh ~/wall.obj --cameras ~/transforms.json --masks ~/masks.json -o ~/out"


@dataclass(frozen=True)
class Case:
    """One kind of bad (or merely unusual) input.

    Parameters
    ----------
    name : the input, as named on the page.
    code : the exit code expected.
    says : text that the output must contain.
    files : files of the case's folder and their contents.
    command : arguments of `walltopo`; `~` is the case's folder.
    photos : number of good photos in the folder `in`, p0.jpg and so on.
    """

    name: str
    code: int
    says: str
    files: f.Files = field(default_factory=dict)
    command: str = INGEST
    photos: int = 3

    def make(self, root: Path) -> list[str]:
        """Write the input into a folder and return the arguments of `walltopo`."""
        photos = {f"in/p{number}.jpg": f.image(number) for number in range(self.photos)}
        for name, content in [*photos.items(), *self.files.items()]:
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if callable(content):
                content(path)
            else:
                path.write_bytes(content.encode() if isinstance(content, str) else content)
        return [word.replace("~", str(root)) for word in shlex.split(self.command)]


ALL = ("p0.jpg", "p1.jpg", "p2.jpg")
SCAN = {"gym/scan.json": '{"version": 1, "stages": {}}'}
SCAN_AND_SITE = {**SCAN, "site/index.html": "mine"}
GYM = {"gym/gym.sqlite": "", "there.tar": "mine"}
PAGE = {"scan/index.html": ""}
NO_MASKS = '{"images": [], "categories": [], "annotations": []}'
LINES = {
    "imagePath": "a.png",
    "imageWidth": 20,
    "imageHeight": 18,
    "shapes": [{"label": "x", "shape_type": "line", "points": [[1, 1], [5, 5]]}],
}
RECORD3D = {
    "w": 640,
    "h": 480,
    "K": [500, 0, 0, 0, 500, 0, 320, 240, 1],
    "poses": [[0, 0, 0, 0, 1, 2, 3]] * 3,
}
METASHAPE = (
    '<document><chunk><sensors><sensor id="0"><resolution width="640" height="480"/><calibration>'
    "<f>500</f><k4>0.1</k4></calibration></sensor></sensors><cameras>"
    '<camera id="0" sensor_id="0" label="p0"><transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform>'
    "</camera></cameras></chunk></document>"
)
CSV = "#name,x,y,alt,heading,pitch,roll,f\n"
PLY = "ply\nformat ascii 1.0\nelement vertex 2000000000\nproperty float x\nend_header\n"
DRACO = '{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"]}'
SPHERE = b'<rdf:Description GPano:ProjectionType="equirectangular"/>'
SETTINGS = "[ingest]\nmax_side = 1280\n"

# A row each.
# fmt: off
PHOTO_CASES = (
    Case("a folder without photos", 3, "no photos here", {"in": Path.mkdir}, photos=0),
    Case("a path that does not exist", 3, "no such file or folder", command="scan ~/nowhere -o ~/scan --to ingest"),
    Case("a text file named .jpg", 3, "not an image that is read here", {"in/note.jpg": "dear diary"}, photos=2),
    Case("a truncated JPEG among too few", 3, "damaged or cut off", {"in/p0.jpg": f.cut(3)}),
    Case("a file of zero bytes", 3, "not an image", {"in/empty.jpg": ""}, photos=2),
    Case("a 16-bit grey PNG", 0, "photos 4, skipped 0", {"in/deep.png": f.grey_16_bit}),
    Case("a CMYK JPEG", 0, "photos 4, skipped 0", {"in/print.jpg": f.cmyk}),
    Case("a PNG named .jpg", 0, "photos 3, skipped 0", {"in/really_png.jpg": f.image(5, kind="PNG")}, photos=2),
    Case("one photo", 3, "1 usable photo, at least 3 are needed", photos=1),
    Case("the same photo five times", 3, "shows the same as same4.jpg", {f"in/same{k}.jpg": f.image(0, quality=80 + k) for k in range(5)}, photos=0),
    Case("thumbnails", 3, "smaller than 320 px", {f"in/thumb{k}.png": f.image(k, (160, 120)) for k in range(4)}, photos=0),
    Case("photos of fog", 3, "blurred", {f"in/fog{k}.png": f.plain("RGB", (640, 480), (40 * k, 90, 90)) for k in range(4)}, photos=0),
    Case("a panorama among photos", 0, "a panorama; it has no single camera", {"in/pano.png": f.image(8, (6000, 1000))}),
    Case("a picture of 1.6 gigapixels", 0, "too large to be a phone photo", {"in/bomb.png": f.plain("1", (40_000, 40_000))}),
    Case("spaces, umlauts and emoji in paths", 0, "photos 3", {f"Wände & Räume (neu) 🧗/mes photos/p{k}.jpg": f.image(k) for k in range(3)}, "scan '~/Wände & Räume (neu) 🧗/mes photos' -o '~/Wände & Räume (neu) 🧗/scan' --to ingest", 0),
    Case("noise named .mp4", 3, "cannot be decoded as a video", {"in/walk.mp4": np.random.default_rng(0).bytes(5000)}, photos=0),
    Case("other files among the photos", 0, "neither a photo nor a video", {"in/list.xlsx": "x", "in/folder.jpg": Path.mkdir}),
    Case("an output folder that cannot be made", 5, "cannot create", command="scan ~/in -o /proc/walltopo-scan --to ingest"),
    Case("an output that is a file", 3, "is a file, expected a folder", {"scan": "a file"}),
    Case("an output folder with other things", 3, "not a scan folder", {"scan/holiday.txt": "not a scan"}),
    Case("a damaged scan.json", 3, "not valid JSON", {"scan/scan.json": '{"version": 1, "stages"'}),
    Case("an unknown setting", 2, "Did you mean ingest.max_side?", command=f"{INGEST} --set ingest.max_sid=100"),
    Case("an impossible setting", 2, "expected at least 640, got -1", command=f"{INGEST} --set ingest.max_side=-1"),
    Case("an unknown stage", 3, "unknown stage 'meshing'", command="scan ~/in -o ~/scan --to meshing"),
    Case("photos that show nothing in common", 4, "could be registered", command="scan ~/in -o ~/scan --to sparse", photos=4),
    Case("a reference that is no scan", 3, "has no cameras", {"old": Path.mkdir}, "scan ~/in -o ~/scan --to sparse --reference ~/old"),
    Case("a pipe among the photos", 0, "skipped pipe.jpg: a pipe, not a file", {"in/pipe.jpg": os.mkfifo}),
    Case("links to nothing and in a circle", 0, "a link that leads in a circle", {"in/gone.jpg": f.link("moved-away.jpg"), "in/round.jpg": f.link("round.jpg")}),
    Case("half a HEIC", 0, "skipped photo.heic: ", {"in/photo.heic": f.half(f.image(kind="HEIF"))}),
    Case("half an AVIF named .jpg", 0, "skipped photo.jpg: ", {"in/photo.jpg": f.half(f.image(kind="AVIF"))}),
    Case("half a WebP named .jpg", 0, "skipped photo.jpg: ", {"in/photo.jpg": f.half(f.image(kind="WEBP"))}),
    Case("half a film", 0, "cannot be decoded as a video", {"in/walk.mp4": f.half(f.film)}),
    Case("PostScript named .jpg", 0, "not an image that is read here", {"in/drawing.jpg": "%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n"}),
    Case("a GIF named .jpg", 0, "not an image that is read here", {"in/moving.jpg": f.image(kind="GIF")}),
    Case("names that are not UTF-8, and of 254 bytes", 0, "photos 3, skipped 0", {"in/p0.jpg": f.renamed("caf\udce9.jpg"), "in/p1.jpg": f.renamed("ü" * 125 + ".jpg")}),
    Case("folders whose names are not UTF-8", 0, "photos 3, skipped 0", {"in": f.renamed("caf\udce9")}, "scan ~/caf\udce9 -o ~/caf\udce9-scan --to ingest"),
    Case("a PNG of 250 megapixels", 0, "MiB of memory, more than", {"in/huge.png": f.huge_png}),
    Case("a scan in the folder of photos", 0, "skipped wall: a scan folder", {"in/wall/scan.json": "{}"}),
    Case("a scan folder in place of photos", 3, "is a scan folder, not a folder", {"in/scan.json": "{}"}),
    Case("a stored photo cut off since", 0, "was changed since ingest wrote it", {"in": f.scan_and_damage}),
    Case("the same, and its original gone", 3, "was deleted after the scan", {"in": f.scan_damage_and_move}, "scan -o ~/scan --to ingest"),
    Case("a 360-degree photo among photos", 0, "skipped sphere.jpg: a 360-degree photo", {"in/sphere.jpg": f.image(7, (1280, 640), xmp=SPHERE)}),
    Case("the film of a Live Photo", 0, "the moving part of a Live Photo", {"in/p0.MOV": f.film}),
    Case("an archive among photos", 0, "skipped wall.zip: an archive; unpack it", {"in/wall.zip": f.archive}),
    Case("small pictures named before large ones", 0, "shows the same as p0.jpg", {**{f"in/p{k}.jpg": f.image(k, (1280, 960), quality=95) for k in range(3)}, **{f"in/p{k}.DNG": f.small_preview(k) for k in range(3)}}),
    Case("a raw photo with a small preview", 0, "only the preview of 640x480 px", {"in/raw.DNG": f.image(kind="TIFF", tiffinfo={254: 1})}),
    Case("pictures named .jfif and .bmp", 0, "photos 5, skipped 0", {"in/p8.jfif": f.image(8, kind="JPEG"), "in/p9.bmp": f.image(9)}),
)

POSE_CASES = (
    Case("`--poses` of nothing", 3, "no such file or folder", command=POSES),
    Case("`--poses` of a folder that holds none", 3, "no camera poses", {"poses/notes.txt": "x"}, POSES),
    Case("poses of other photos", 3, "none of its 2 poses is of one of the 3 photos", {"poses/transforms.json": f.frames(["a.jpg", "b.jpg"])}, POSES),
    Case("two poses for one photo", 3, "a photo named p0.jpg occurs twice", {"poses/transforms.json": f.frames([*ALL, "p0.jpg"])}, POSES),
    Case("poses a billion metres away", 3, "Expected `float` <= 1000000000.0", {"poses/transforms.json": f.frames(ALL, f.FAR)}, POSES),
    Case("a pose that mirrors", 3, "mirrors", {"poses/transforms.json": f.frames(ALL, f.MIRRORED)}, POSES),
    Case("a pose that shears", 3, "not a rigid transform", {"poses/transforms.json": f.frames(ALL, f.SHEARED)}, POSES),
    Case("poses of a 360-degree camera", 3, "EQUIRECTANGULAR", {"poses/transforms.json": f.frames(ALL, camera_model="EQUIRECTANGULAR")}, POSES),
    Case("a Record3D pose that is not a rotation", 3, "is not a rotation", {"poses/metadata": json.dumps(RECORD3D)}, POSES),
    Case("a RealityScan CSV with letters for a number", 3, "cameras.csv", {"poses/cameras.csv": f"{CSV}p0.jpg,1,2,3,north,0,0,26\n"}, POSES),
    Case("a `transforms.json` of UTF-16, cut off", 3, "not valid JSON", {"poses/transforms.json": "\N{BYTE ORDER MARK}{".encode("utf-16-le")}, POSES),
    Case("a RealityScan CSV in Windows' letters", 3, "not text in UTF-8", {"poses/cameras.csv": f"{CSV}Höhe.jpg,1,2,3,0,0,0,26\n".encode("cp1252")}, POSES),
    Case("a lens of Metashape with k4", 3, "k4 is not understood", {"poses/cameras.xml": METASHAPE}, POSES),
    Case("a lens that folds back within the photo", 3, "folds back", {"poses/transforms.json": f.frames(ALL, k1=-8)}, POSES),
    Case("`--mesh` without poses", 2, "dense.mesh needs sparse.poses", command="scan ~/in -o ~/scan --to dense --mesh ~/wall.obj"),
    Case("`import polycam` of plain photos", 3, "is not the layout of", command="import polycam ~/in --dry-run"),
    Case("`import auto` of plain photos", 3, "no camera poses", command="import auto ~/in --dry-run"),
    Case("`import scaniverse`", 3, "is not documented", command="import scaniverse ~/in --dry-run"),
)

COMMAND_CASES = (
    # Only the `view` cases that end by themselves; docs/security.md covers a running server.
    Case("`view` of what has no page", 3, "no page to show", command="view ~/scan", photos=0),
    Case("`view --port 99999`", 2, "65535", PAGE, "view ~/scan --port 99999", 0),
    Case("`view --port -1`", 2, "-1", PAGE, "view ~/scan --port -1", 0),
    Case("`view --host 0.0.0.0`", 2, "every address", PAGE, "view ~/scan --host 0.0.0.0", 0),
    Case("`view --host` of another machine", 2, "not an address of this machine", PAGE, "view ~/scan --host 192.0.2.1 --port 0", 0),
    Case("`view --embed` of no origin", 2, "is not an origin", PAGE, "view ~/scan --embed gym", 0),
    Case("`export -o` into the scan itself", 3, "belongs to the scan", SCAN, "export ~/gym -o ~/gym --format labelme --overwrite", 0),
    Case("`export -o` a file of the scan", 3, "belongs to", SCAN, "export ~/gym -o ~/gym/mesh.ply", 0),
    Case("`merge -o` a web site's folder", 3, "is not empty", SCAN_AND_SITE, "merge ~/gym ~/gym --same-frame -o ~/site", 0),
    Case("`merge -o` another scan", 3, "belongs to", SCAN_AND_SITE, "merge ~/gym ~/gym --same-frame -o ~/gym --overwrite", 0),
    Case("`-o` a file that is there", 3, "is there already", {"plate.pdf": "mine"}, "measure print -o ~/plate.pdf", 0),
    Case("`gym backup` of no gym", 3, "no gym there", GYM, "gym backup --data ~/gmy ~/b.tar", 0),
    Case("`gym backup` onto a file", 3, "is there already", GYM, "gym backup --data ~/gym ~/there.tar", 0),
    Case("`gym backup` onto the gym", 3, "belongs to the gym itself", GYM, "gym backup --data ~/gym ~/gym/gym.sqlite --overwrite", 0),
    Case("`-o` a named pipe", 3, "no file can replace it", {"pipe": os.mkfifo}, "measure print -o ~/pipe --overwrite", 0),
    Case("`-o` a device", 3, "no file can replace it", command="measure print -o /dev/null --overwrite", photos=0),
    Case("`merge --near nan`", 2, "a finite number", SCAN, "merge ~/gym ~/gym --same-frame -o ~/new --near nan", 0),
    Case("`merge --near -1`", 2, "at least 0.001", SCAN, "merge ~/gym ~/gym --same-frame -o ~/new --near -1", 0),
    Case("a settings file that is a folder", 3, "cannot be read", {"settings": Path.mkdir}, CONFIG, 0),
    Case("settings 100,000 deep", 3, "nested too deeply", {"settings": "a = " + "[" * 100_000}, CONFIG, 0),
    Case("a setting of 5,000 digits", 3, "not valid TOML", {"settings": "a = " + "9" * 5000}, CONFIG, 0),
    Case("settings as Windows Notepad saves them", 0, "photos 3", {"settings": SETTINGS.encode("utf-16")}, CONFIG),
    Case("settings with a byte-order mark", 0, "photos 3", {"settings": SETTINGS.encode("utf-8-sig")}, CONFIG),
    Case("settings that are not UTF-8", 3, "not valid TOML", {"settings": b"\xff"}, CONFIG, 0),
    Case("a path with escape codes and markup", 3, r"\x1b[31m[/red]: not a scan folder", command="status ~/\x1b[31m[/red]", photos=0),
    Case("OpenMVS asked for, and not here", 5, "not found in /nowhere", command=f"{EXPORT} --set dense.openmvs_bin=/nowhere --set dense.backend=openmvs"),
    Case("a detector that is not there", 3, "nowhere.onnx", command=f"{EXPORT} --set detect.model=nowhere.onnx"),
    Case("a detector of no name", 3, "neither a known detector", command=f"{EXPORT} --set detect.model=yolo99"),
    Case("`export --format page` onto a file", 3, "is there already", {**SCAN, "wall.html": "mine"}, "export ~/gym --format page -o ~/wall.html", 0),
    Case("`export --format site` into a web site", 3, "is not empty", {**SCAN, "web/index.html": "mine"}, "export ~/gym --format site -o ~/web", 0),
    Case("a shell without completion", 2, "invalid choice", command="completion csh", photos=0),
)

FILE_CASES = (
    Case("labels: a photo named `../a.png`", 3, "leads out of its folder", f.coco("../a.png"), LABELS, 0),
    Case("labels: a photo named `/etc/passwd`", 3, "leads out of its folder", f.coco("/etc/passwd"), LABELS, 0),
    Case("labels: a polygon at 1e300", 3, "far outside the picture", f.coco(segmentation=[[1e300, 1, 5, 5, 9, 9]]), LABELS, 0),
    Case("labels: a polygon of five numbers", 3, "an odd number", f.coco(segmentation=[[1, 2, 3, 4, 5]]), LABELS, 0),
    Case("labels: RLE of 2^31 pixels a side", 3, "segmentation.size", f.coco(segmentation={"size": [2**31, 2**31], "counts": [0]}), LABELS, 0),
    Case("labels: an unknown category", 3, "there is no category 9", f.coco(category_id=9), LABELS, 0),
    Case("labels: a number where a list is meant", 3, "segmentation", f.coco(segmentation=7), LABELS, 0),
    Case("labels: LabelMe with lines alone", 3, "none of its shapes is understood: 1 of 'line'", {"a.json": json.dumps(LINES)}, "dataset convert ~/a.json ~/to --to coco", 0),
    Case("labels: CVAT's own XML", 3, "COCO 1.0", {"annotations.xml": "<annotations><version>1.1</version></annotations>"}, "dataset convert ~/annotations.xml ~/to --to coco", 0),
    Case("labels: Label Studio's own JSON", 3, "Label Studio's own JSON is not read", {"studio.json": '[{"id": 1, "annotations": [], "data": {}}]'}, "dataset convert ~/studio.json ~/to --to coco", 0),
    Case("a PLY that claims two billion vertices", 3, "it declares 2000000000 entries", {"m.ply": PLY}, "mesh check ~/m.ply", 0),
    Case("a `frames.bin` of 45 bytes", 3, "frames.bin: truncated or damaged", {"frames.bin": f.cut_model(45), "masks.json": NO_MASKS}, LIFT.replace("~/transforms.json", "~"), 0),
    Case("a `cameras.bin` cut short", 3, "cameras.bin: truncated or damaged", {"cameras.bin": f.cut_model(40), "masks.json": NO_MASKS}, LIFT.replace("~/transforms.json", "~"), 0),
    Case("a mirrored `transform_matrix`", 3, "frame 0: the pose mirrors", {"transforms.json": f.frames(["a.jpg"], f.MIRRORED), "masks.json": NO_MASKS}, LIFT, 0),
    Case("lift: masks of photos that were turned by EXIF", 3, "its masks are 96x128 pixels", f.lift_scene(masks_size=(96, 128)), LIFT, 0),
    Case("lift: masks that fit the cameras of two folders", 3, "may belong to 2 cameras", f.lift_scene(("cam0/0.jpg", "cam1/0.jpg"), ("0.jpg",)), LIFT, 0),
    Case("lift: most photos of the masks without a camera", 3, "2 of 3 photos of the masks have no camera", f.lift_scene(photos=("0.jpg", "x.jpg", "y.jpg")), LIFT, 0),
    Case("lift: masks without pixels", 3, "all 2 masks are empty", f.lift_scene(segmentation=[]), LIFT, 0),
    Case("lift: a mesh in millimetres, cameras in metres", 3, "a ratio of 1.41e+04", f.lift_scene(scale=1000.0, shift=3000.0), LIFT, 0),
    Case("lift: a mesh in millimetres around the same origin", 3, "0 instances: the masks of different photos agree on no object", f.lift_scene(scale=1000.0), LIFT, 0),
    Case("lift: a lens parameter `k5`", 3, "k5 is not understood", f.lift_scene(k5=0.1), LIFT, 0),
    Case("lift: a panoramic `camera_model`", 3, "'EQUIRECTANGULAR' is not supported", f.lift_scene(camera_model="EQUIRECTANGULAR"), LIFT, 0),
    Case("lift: glTF compressed by Draco", 3, "requires the extension KHR_draco_mesh_compression", {**f.lift_scene(), "wall.gltf": DRACO}, LIFT.replace("wall.obj", "wall.gltf"), 0),
)
# fmt: on
CASES = (*PHOTO_CASES, *POSE_CASES, *COMMAND_CASES, *FILE_CASES)
