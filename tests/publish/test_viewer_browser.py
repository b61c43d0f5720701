"""The viewer in a real browser, one test per file of `viewer/tests`, on scans made here."""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from likeness import MEAN_BOUND, TILE_BOUND, alike, difference, small  # type: ignore[import-not-found]
from made_scan import build_scan, export_alone, export_scan, hold_places, panel  # type: ignore[import-not-found]
from PIL import Image
from served import served  # type: ignore[import-not-found]

from walltopo.describe.classify.low_confidence import BUMP, FAINT, PLATED
from walltopo.describe.routes.start_and_top import START_REASONS, TOP_REASONS
from walltopo.editing.entries import REMOVED
from walltopo.editing.messages import REASONS
from walltopo.pipeline.edit_session import open_session
from walltopo.publish.settings import ExportSettings
from walltopo.publish.wall_data import read_wall
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import FLAT, Hold, count_words, steepness_words

VIEWER = Path(__file__).resolve().parents[2] / "viewer"
SMALL = ExportSettings(first_triangles=6000, title="Test wall")
# Reference screenshots: a folder for each flow that has any.
REFERENCES = Path(__file__).parent / "references"
# The longest come first.
FLOWS = (
    "checks",
    "keys",
    "reading",
    "editing",
    "page",
    "frames",
    "hands",
    "foreign",
    "tasks",
    "reset",
    "borders",
    "touch",
    "growing",
)
# Screenshots of the last run, for people to look at: a folder for each flow.
SHOTS = Path(os.environ.get("WALLTOPO_SHOTS", VIEWER.parent / "build" / "viewer-shots"))
# Ways to break every page, and checks that must notice (see SABOTAGE in viewer/tests/browser.mjs).
SABOTAGE = {
    "load": ["opens from disk", "works by keyboard alone", "has no serious accessibility findings"],
    "draw": ["opens from disk", "a lit route stays", "survives a lost context"],
    "tap": ["a tap on a hold", "a link leads", "the camera stays", "no frame is asked"],
    "write": ["a lit route stays"],
}

EMBED = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Embedded</title>
<meta name="viewport" content="width=device-width">
<style>wall-topo{display:block;width:800px;height:500px}</style>
<script>window.heard=[];
for(const type of ["wall-load","hold-select","route-select"])
 addEventListener(type,e=>heard.push({type,detail:e.detail}))</script>
<main><wall-topo src="page/first.glb"></wall-topo></main><script src="page/viewer.js"></script>"""


LAZY = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Lazy</title>
<style>wall-topo{display:block;width:800px;height:500px}
wall-topo::part(card){background:rgb(1 2 3)}</style>
<div style="height:4000px"></div>
<main><wall-topo src="page/first.glb" loading="lazy" poster="cutouts/1.png" heading="Lazy">
<button slot="tools" id="mine">Mine</button><p slot="card" id="below">Below the card</p>
</wall-topo></main><script src="page/viewer.js"></script>"""


def terminal_words() -> dict[str, Any]:
    """Return the words of the terminal and the report, which the page must have too."""
    degrees = (-20.4, -6, -5.4, -3, 0, 3.4, 4.6, 5.4, 5.6, 6.9, 10, 16.7, 34.6, 60)
    counts = ((0, 0, 0), (1, 1, 0), (4, 31, 2), (2, 5, 1))
    kind = {"hold": made_row(1, "hold"), "volume": made_row(2, "volume")}
    return {
        "reasons": [BUMP, FAINT, FLAT, PLATED, REMOVED],
        "doubts": sorted({*START_REASONS.values(), *TOP_REASONS.values()}),
        "notes": REASONS,
        "problems": ["busy", "changed", "lacks", "large", "token"],
        "steepness": [[value, steepness_words(value)] for value in degrees],
        "counts": [
            [r, h, v, count_words(r, [kind["hold"]] * h + [kind["volume"]] * v)]
            for r, h, v in counts
        ],
    }


def made_row(number: int, kind: str) -> Hold:
    """A row of `holds.json`."""
    place, normal = (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)
    return Hold(number, kind, "jug", "red", (200, 40, 40), place, normal, 0.1, 0.01, 0, (), 1, None)


def missing() -> str:
    """Why these tests cannot run here; empty when they can."""
    chromium = os.environ.get("WALLTOPO_CHROMIUM", "/usr/bin/chromium")
    if shutil.which("node") is None:
        return "node is not installed (make system)"
    if not Path(chromium).exists():
        return f"no browser at {chromium} (make system)"
    if not (VIEWER / "node_modules" / "@playwright").is_dir():
        return "viewer/node_modules is missing (cd viewer && npm ci)"
    return ""


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing()), reason=f"browser tests: {missing()}"),
]


def exported(root: Path, settings: ExportSettings = SMALL, **options: Any) -> ScanFolder:
    scan: ScanFolder = build_scan(root, **options)
    export_scan(scan, settings)
    return scan


def untextured(root: Path, settings: ExportSettings, **options: Any) -> Path:
    """The page of a wall without a texture."""
    wall = read_wall(build_scan(root / "scan", **options), settings.title or root.name)
    scan: ScanFolder = export_alone(root, replace(wall, uv=None, texture=None), settings)
    return scan.page


def without_ids(scan: ScanFolder, folder: Path) -> Path:
    """A page whose model is a plain GLB of another tool."""
    import trimesh

    shutil.copytree(scan.root / "page", folder / "page")
    shutil.copyfile(scan.page, folder / "index.html")
    ball = trimesh.creation.icosphere(subdivisions=2)
    data = ball.export(file_type="glb")
    from walltopo.publish.web_page import write_tier

    for name in ("first", "detail"):
        write_tier(folder / "page", name, data)
    return folder / "index.html"


def with_labels(scan: ScanFolder, folder: Path, document: object) -> Path:
    """A page with other labels beside its tiers."""
    shutil.copytree(scan.root / "page", folder / "page")
    shutil.copyfile(scan.page, folder / "index.html")
    text = json.dumps(document)
    (folder / "page" / "labels.json").write_text(text)
    script = f'(window.wallTopoTiers??={{}})["labels.json"]={text};'
    (folder / "page" / "labels.js").write_text(script)
    return folder / "index.html"


def strange(scan: ScanFolder, folder: Path) -> Path:
    """A page with tables of another program beside one hold and one route of ours."""
    tables = json.loads((scan.root / "page" / "labels.json").read_text())
    good = tables["holds"][0]
    tables["holds"] = [None, 7, {"id": "x"}, {"id": 3}, {"id": 4, "position": [0, None, 1]}, good]
    tables["holds"].append({"id": 2, "position": [1, -0.1, 2], "colour_rgb": "red", "type": "foot"})
    tables["routes"] = [{"id": 9}, {"id": 8, "holds": [1, 2, 99], "colour": None}, "none"]
    return with_labels(scan, folder, tables)


def broken(scan: ScanFolder, folder: Path, data: bytes | None) -> Path:
    """A page whose model is damaged (or absent)."""
    from walltopo.publish.web_page import write_tier

    shutil.copytree(scan.root / "page", folder / "page")
    shutil.copyfile(scan.page, folder / "index.html")
    (folder / "page" / "first.js").unlink()
    if data is not None:
        write_tier(folder / "page", "first", data)
    return folder / "index.html"


def model_alone(folder: Path, data: bytes) -> Path:
    """A page with one tier."""
    from walltopo.publish.web_page import write_page, write_tier

    (folder / "page").mkdir(parents=True)
    write_tier(folder / "page", "first", data)
    index = folder / "index.html"
    write_page(index, folder / "page", "Alone")
    index.write_text(index.read_text().replace(' detail="page/detail.glb"', ""))
    return index


def large_model() -> bytes:
    """A panel of 5.0 million triangles, none of them simplified away."""
    from walltopo.publish.gltf import Packing, write_glb
    from walltopo.publish.surface import split_at_borders

    mesh, labels, _, _ = panel(0, 1940)
    return write_glb(split_at_borders(mesh, labels), [], [], packing=Packing(True, True, False))


QUARTERS = (2100, 3000)  # pixels: no whole number of pieces
COLOURS = ((200, 40, 40), (40, 160, 60), (40, 70, 200), (230, 190, 40))


def quartered_model() -> bytes:
    """A panel under a large picture: four quarters, each of one colour."""
    import io

    from walltopo.publish.gltf import Packing, write_glb
    from walltopo.publish.surface import split_at_borders

    mesh, labels, uv, _ = panel(0, 40)
    width, height = QUARTERS
    pixels = np.zeros((height, width, 3), np.uint8)
    for k, colour in enumerate(COLOURS):
        top, left = k // 2 * height // 2, k % 2 * width // 2
        pixels[top : top + height // 2, left : left + width // 2] = colour
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return write_glb(
        split_at_borders(mesh, labels, uv),
        [],
        [],
        picture=(stream.getvalue(), "image/png"),
        packing=Packing(True, True, False),
    )


def endless_model() -> bytes:
    """A GLB of few bytes that asks for 5 billion vertices: accessors may leave their zeros out."""
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "count": 5_000_000_000, "type": "VEC3"}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


def edited_files(scan: ScanFolder) -> str:
    """Return the faults of the log that the editor's tests saved; "" without any."""
    found = [msgspec.to_builtins(edit) for edit in EditLog.load(scan.edits).edits]
    for edit in found:
        for key in ("hold", "route"):
            edit[key] = edit[key]["id"] if key in edit else None
    expected: list[dict[str, object]] = [
        {"do": "hold", "hold": 2},
        {"do": "hold", "hold": 5, "colour": "green"},
        {"do": "hold", "hold": 5, "second_colour": "red"},
        {"do": "hold", "hold": 5, "type": "crimp"},
        {"do": "split", "new": 5},
        {"do": "route", "route": 3, "name": "<b>Heron</b>"},
        {"do": "route", "route": 3, "grade": "6b"},
        {"do": "route", "route": 3, "setter": "Anna"},
        {"do": "route", "route": 3, "date": "2026-03-01"},
        {"do": "merge"},
        {"do": "hold", "hold": 12, "type": "sloper"},
    ]
    same = len(found) == len(expected) and all(
        wanted.items() <= edit.items() for wanted, edit in zip(expected, found, strict=True)
    )
    return "" if same else json.dumps(found)


def run_npx(*command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a program of the viewer's packages."""
    return subprocess.run(
        [str(VIEWER / "node_modules" / ".bin" / command[0]), *command[1:]],
        cwd=VIEWER,
        capture_output=True,
        text=True,
        timeout=9000,
        check=False,
        env={**os.environ, **environment},
    )


def run_playwright(
    listing: Path, shots: Path, folder: Path, *words: str, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run browser tests on the pages of a listing.

    Parameters
    ----------
    listing : file of the pages; shots : folder for screenshots; folder : for what failures leave;
    words : which tests.
    """
    own = folder / "places.json"
    own.write_text(json.dumps(json.loads(listing.read_text()) | {"shots": str(shots)}))
    words = (*words, f"--output={folder / 'failures'}")
    return run_npx("playwright", "test", *words, WALLTOPO_PLACES=str(own), **environment)


class GrowingScan:
    """A scan that has one more look after each that somebody saw, and then its page."""

    title = "Growing wall"
    LOOKS = ("scale-1", "dense-2")

    def __init__(self, finished: ScanFolder, root: Path) -> None:
        self._page = finished.page
        self._root = Path(shutil.copytree(finished.root, root))
        (root / "index.html").unlink()
        self._tier = finished.glb.read_bytes()
        self._seen: set[str] = set()

    def status(self) -> dict[str, object]:
        left = [look for look in self.LOOKS if look not in self._seen]
        if not left:
            shutil.copyfile(self._page, self._root / "index.html")
        stages = [
            {"name": name, "state": "done" if f"{name}-" in "".join(self._seen) else "running"}
            for name in ("scale", "dense")
        ]
        return {
            "stages": stages,
            "running": bool(left),
            "look": (left or self.LOOKS[-1:])[0],
            "problem": "",
            "finished": not left,
        }

    def look(self, name: str) -> bytes:
        self._seen.add(name)
        return self._tier


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, ScanFolder]]:
    """The list of pages to check, served as long as it takes; and the scan that is edited."""
    room = tmp_path_factory.mktemp("viewer")
    scan = exported(room / "scan")
    (scan.root / "embed.html").write_text(EMBED)
    (scan.root / "lazy.html").write_text(LAZY)
    Image.new("RGB", (8, 8)).save(scan.cutouts / "1.png")
    shutil.copyfile(VIEWER.parent / "examples" / "embed.html", scan.root / "example.html")
    good = (scan.root / "page" / "first.glb").read_bytes()
    pages = [
        with_labels(scan, room / "labels", {"holds": [], "routes": [], "surface": {"patches": 7}}),
        broken(scan, room / "absent", None),
        broken(scan, room / "cut", good[: len(good) // 2]),
        broken(scan, room / "text", b"this is no model"),
    ]
    odd = {
        "plain": without_ids(scan, room / "plain"),
        "strange": strange(scan, room / "strange"),
        "none": untextured(room / "none", SMALL, holds=0, cells=24),
        "many": untextured(room / "many", ExportSettings(), holds=2000, cells=300),
    }
    editing = exported(room / "editing")
    listing = room / "places.json"
    found = {
        "disk": scan.page.as_uri(),
        "report": scan.report.as_uri(),
        "embed": (scan.root / "embed.html").as_uri(),
        "lazy": (scan.root / "lazy.html").as_uri(),
        "example": (scan.root / "example.html").as_uri(),
        "broken": [page.as_uri() for page in pages],
        "large": model_alone(room / "large", large_model()).as_uri(),
        "quarters": {
            "page": model_alone(room / "quarters", quartered_model()).as_uri(),
            "size": QUARTERS,
            "colours": list(
                zip([[1, 0, 3.2], [5, 0, 3.2], [1, 0, 0.8], [5, 0, 0.8]], COLOURS, strict=True)
            ),
        },
        "endless": model_alone(room / "endless", endless_model()).as_uri(),
        "odd": {kind: page.as_uri() for kind, page in odd.items()},
    }
    after = exported(room / "reset", missed=1)
    narrow = exported(room / "touch", missed=1)
    dense = exported(room / "spray", holds=40)
    growing = GrowingScan(scan, room / "growing")
    with (
        served(scan.root, edit=False) as web,
        served(editing.root, edit=True, opened=open_session) as edit,
        served(after.root, edit=True, opened=open_session) as reset,
        served(dense.root, edit=True, opened=open_session) as spray,
        served(narrow.root, edit=True, opened=open_session) as touch,
        served(room / "growing", edit=False, unfinished=growing) as first_look,
    ):
        found["growing"] = first_look.url
        found |= {"web": web.url, "edit": edit.url, "spray": spray.url}
        x, z = hold_places(12)[-1]
        missed = [x, 0.0, z]
        found["reset"] = {"address": reset.url, "missed": missed}
        found["touch"] = {"address": touch.url, "missed": missed}
        listing.write_text(json.dumps(found))
        yield listing, editing


def test_every_flow_is_listed() -> None:
    files = {path.name.removesuffix(".spec.mjs") for path in (VIEWER / "tests").glob("*.spec.mjs")}
    assert files == set(FLOWS)
    assert {folder.name for folder in REFERENCES.iterdir()} <= files


@pytest.mark.parametrize("flow", FLOWS)
def test_flow(places: tuple[Path, ScanFolder], flow: str, tmp_path: Path) -> None:
    """A file of checks; then its screenshots against their references.

    WALLTOPO_WRITE_REFERENCES=1 replaces the references.
    """
    shots = SHOTS / flow
    shots.mkdir(parents=True, exist_ok=True)
    done = run_playwright(places[0], shots, tmp_path, f"{flow}.spec.mjs")
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]
    problem = edited_files(places[1]) if flow == "editing" else ""
    assert not problem, problem
    for reference in sorted((REFERENCES / flow).glob("*.jpg")):
        shot = small(shots / f"{reference.stem}.png")
        if os.environ.get("WALLTOPO_WRITE_REFERENCES"):
            shot.save(reference, quality=82)
        found, bounds = difference(shot, small(reference)), (MEAN_BOUND, TILE_BOUND)
        assert alike(shot, small(reference)), f"{shots}: {found} over {bounds} from {reference}"


def test_units(tmp_path: Path) -> None:
    words = tmp_path / "words.json"
    words.write_text(json.dumps(terminal_words()))
    done = run_npx("vitest", "run", WALLTOPO_WORDS=str(words))
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]


@pytest.mark.parametrize("way", SABOTAGE)
def test_checks_fail_on_broken_pages(
    places: tuple[Path, ScanFolder], way: str, tmp_path: Path
) -> None:
    """These tests are marked as failing: Playwright reports one that passes."""
    words = ["--grep", "|".join(SABOTAGE[way])]
    done = run_playwright(places[0], tmp_path, tmp_path, *words, WALLTOPO_SABOTAGE=way)
    assert done.returncode == 0, f"pass on pages where {way} is broken: {done.stdout[-4000:]}"


@pytest.mark.parametrize("tier", ["wall.glb", "page/first.glb", "page/detail.glb"])
def test_valid_by_gltf_validator(tmp_path: Path, tier: str) -> None:
    scan = exported(tmp_path / "scan", cells=40)
    script = (
        "const v=require('gltf-validator'),fs=require('fs');"
        "v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))"
        ".then(r=>console.log(JSON.stringify(r.issues)))"
    )
    done = subprocess.run(
        ["node", "-e", script, str(scan.root / tier)],
        cwd=VIEWER,
        capture_output=True,
        text=True,
        timeout=900,
        check=True,
    )
    issues = json.loads(done.stdout)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"][:5]


def test_budgets() -> None:
    """JavaScript within 250 kB gzip."""
    import gzip

    from walltopo.publish.web_page import viewer_script

    packed = gzip.compress(viewer_script().read_bytes(), 9)
    assert len(packed) <= 250_000


def test_the_viewers_types_are_right() -> None:
    done = subprocess.run(
        ["node_modules/.bin/tsc", "--noEmit"],
        cwd=VIEWER,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:]
