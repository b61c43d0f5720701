"""The report's sections, each from what it tells to HTML."""

from __future__ import annotations

import base64
from io import BytesIO
from pathlib import Path
from typing import Any

from walltopo.export.report.facts import Facts
from walltopo.export.report.markup import bars, card, number, section, table, text
from walltopo.export.wall import Wall

__all__ = [
    "attention",
    "figures_of_merit",
    "left_out_section",
    "measure_section",
    "photo_section",
    "review_section",
    "route_section",
    "step_section",
]

MOST_CUTOUTS = 60
MOST_THUMBNAILS = 60


def picture_url(path: Path, longest: int) -> str | None:
    """A small copy of a picture as a data: address; None where it cannot be read."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as opened:
            opened.thumbnail((longest, longest))
            stream = BytesIO()
            mode = "RGBA" if opened.mode == "RGBA" else "RGB"
            opened.convert(mode).save(stream, "WEBP", quality=72)
    except (OSError, UnidentifiedImageError):
        return None
    return "data:image/webp;base64," + base64.b64encode(stream.getvalue()).decode("ascii")


def _unsure(wall: Wall) -> list[dict[str, Any]]:
    """Holds that someone should look at, the least certain first."""
    doubtful = [hold for hold in wall.holds if hold["review"]]
    return sorted(doubtful, key=lambda hold: (float(hold["score"]), int(hold["id"])))


def figures_of_merit(wall: Wall, facts: Facts, covered: float | None) -> str:
    """The row of figures at the top."""
    volumes = sum(hold["class"] == "volume" for hold in wall.holds)
    total, used = len(facts.photos), len(facts.views)
    cards = []
    if total:
        cards.append(card(f"{used} of {total}", "photos used", "good" if used == total else "warn"))
    cards.append(card(str(len(wall.holds) - volumes), "holds"))
    cards.append(card(str(volumes), "volumes"))
    cards.append(card(str(len(wall.routes)), "routes"))
    tone = "good" if wall.metric else "warn"
    cards.append(card("metres" if wall.metric else "no scale", "unit of lengths", tone))
    if covered is not None:
        tone = "good" if covered > 0.9 else "warn"
        cards.append(card(f"{100 * covered:.0f} %", "of the surface in 3 photos or more", tone))
    return f'<div class="cards">{"".join(cards)}</div>'


def attention(wall: Wall, facts: Facts, spots: int) -> str:
    """What to look at first; a short list or one line that all is well."""
    points: list[str] = []
    if not wall.metric:
        points.append(
            "<b>The scan is unscaled</b>: lengths are in arbitrary units. Put a printed plate on "
            "the floor, or give a known distance."
        )
    if facts.unregistered:
        points.append(
            f"{len(facts.unregistered)} photos could not be placed; they and the reasons are below."
        )
    if facts.skipped:
        points.append(f"{len(facts.skipped)} files were left out before the start.")
    for plate in facts.scale.get("plates", []):
        if plate.get("problem"):
            points.append(f"Plate {text(plate.get('ids'))}: {text(plate['problem'])}.")
    points += [text(note) for note in facts.scale.get("notes", [])]
    if spots:
        points.append(f"{spots} places are seen by too few photos; the map shows where.")
    unsure = len(_unsure(wall))
    if unsure:
        points.append(f"{unsure} holds are uncertain; their pictures are below.")
    if not wall.holds:
        points.append("<b>No hold was found.</b> Look at the photos: are they sharp and near?")
    if not points:
        return section("Worth a look", "<p>Nothing stands out.</p>")
    return section("Worth a look", f"<ul>{''.join(f'<li>{p}</li>' for p in points)}</ul>")


def photo_section(facts: Facts, photos: Path, path: str) -> str:
    """How the photos were put together, and which were not."""
    rows = [
        ("Photos used", f"{len(facts.views)} of {len(facts.photos)}"),
        ("Reprojection error", number(facts.metric("sparse", "reprojection_px"), 2, "px")),
        ("Photos that see a point, on average", number(facts.metric("sparse", "track_length"), 1)),
        ("Points", number(facts.metric("sparse", "points"))),
    ]
    body = table(("Camera positions", ""), [(text(a), text(b)) for a, b in rows], right=(1,))
    if facts.unregistered:
        tiles = []
        for name, reason in list(facts.unregistered.items())[:MOST_THUMBNAILS]:
            url = picture_url(photos / name, 220)
            image = f'<img src="{url}" alt="">' if url else ""
            why = text(reason) if reason else "no reason known"
            tiles.append(f"<li>{image}<b>{text(name)}</b><span>{why}</span></li>")
        body += f'<h3>Not placed</h3><ul class="tiles">{"".join(tiles)}</ul>'
    if facts.skipped:
        left = [(text(item["source"]), text(item["reason"])) for item in facts.skipped]
        body += "<h3>Left out before the start</h3>" + table(("File", "Reason"), left)
    return section("Photos", body + path)


def measure_section(facts: Facts) -> str:
    """How true to size the model is."""
    scale = facts.scale
    if not scale:
        return ""
    known = {True: "yes", False: "no, estimated"}
    rows = [
        ("Scaled by", text(scale.get("method", "none"))),
        ("Up is known", known[bool(scale.get("up_known"))]),
        ("Floor is known", known[bool(scale.get("floor_known"))]),
    ]
    body = table(("World frame", ""), rows)
    plates = [
        (
            text(", ".join(str(i) for i in plate.get("ids", []))),
            number(plate.get("residual_mm"), 2, "mm"),
            str(len(plate.get("photos", []))),
            text(plate.get("problem") or "fits"),
        )
        for plate in scale.get("plates", [])
    ]
    if plates:
        head = ("Markers of the plate", "Residual", "Photos", "Verdict")
        body += table(head, plates, right=(1, 2))
    return section("Measure", body)


def step_section(wall: Wall, facts: Facts, sizes: dict[str, int]) -> str:
    """Mesh size, time and memory per step."""
    import numpy as np

    corners = wall.mesh.vertices[wall.mesh.faces[:: max(1, len(wall.mesh.faces) // 20000)]]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    unit = "mm" if wall.metric else "units"
    factor = 1000.0 if wall.metric else 1.0
    area_unit = "m²" if wall.metric else "units²"
    rows = [
        ("Triangles", number(len(wall.mesh.faces))),
        ("Vertices", number(len(wall.mesh.vertices))),
        ("Median edge", number(float(np.median(edges)) * factor, 1, unit)),
        ("Surface", number(float(wall.mesh.areas.sum()), 1, area_unit)),
    ]
    rows += [(f"{name}", number(size / 1e6, 2, "MB")) for name, size in sizes.items()]
    body = table(("Mesh and files", ""), [(text(a), b) for a, b in rows], right=(1,))
    done = {k: v for k, v in facts.stages.items() if v.get("seconds")}
    longest = max((float(v["seconds"]) for v in done.values()), default=1.0)
    lines = [
        (
            text(name),
            bars(float(record["seconds"]) / longest),
            number(float(record["seconds"]), 1, "s"),
            number(record.get("peak_mb"), 0, "MB"),
        )
        for name, record in done.items()
    ]
    if lines:
        body += table(("Step", "", "Time", "Peak memory"), lines, right=(2, 3))
    return section("Mesh and time", body)


def _dot(rgb: Any) -> str:
    if not rgb:
        return ""
    red, green, blue = (int(v) for v in rgb)
    return f'<i class="dot" style="background:rgb({red},{green},{blue})"></i>'


def route_section(wall: Wall) -> str:
    """The table of routes."""
    if not wall.routes:
        return section("Routes", "<p>No routes were found.</p>")
    colour = {int(hold["id"]): hold["colour_rgb"] for hold in wall.holds}
    unit = "m" if wall.metric else "units"
    rows = []
    for route in wall.routes:
        rgb = next((colour[h] for h in route["holds"] if colour.get(h)), None)
        name = route.get("name") or f"{route['colour']} {route['id']}".capitalize()
        ambiguous = len(route.get("ambiguous", []))
        rows.append(
            (
                f"{_dot(rgb)}{text(name)}",
                str(len(route["holds"])),
                number(route.get("length_m"), 1, unit),
                number(route.get("steepness_deg"), 0, "°"),
                str(ambiguous) if ambiguous else "",
            )
        )
    head = ("Route", "Holds", "Length", "Steepness", "Ambiguous holds")
    return section("Routes", table(head, rows, right=(1, 2, 3, 4)))


def _tile(facts: Facts, folder: Path | None, number: int, words: str) -> str:
    """A small card with the best cutout of an instance, its id and some words (HTML)."""
    file = facts.cutouts.get(number) if folder else None
    url = picture_url(folder / file, 128) if folder and file else None
    image = f'<img src="{url}" alt="">' if url else '<span class="blank"></span>'
    return f"<li>{image}<b>{number}</b><span>{words}</span></li>"


def _tiles(tiles: list[str]) -> str:
    return f'<ul class="tiles small">{"".join(tiles)}</ul>'


def review_section(wall: Wall, facts: Facts, cutouts: Path, pictures: bool) -> str:
    """Uncertain holds with their pictures."""
    unsure = _unsure(wall)
    if not unsure:
        return ""
    tiles = []
    for hold in unsure[:MOST_CUTOUTS]:
        what = f"{hold['colour'] or ''} {hold['type'] or hold['class']}".strip()
        sure = f"{100 * float(hold['score']):.0f} % certain"
        words = f"{_dot(hold['colour_rgb'])}{text(what)}, {sure}"
        tiles.append(_tile(facts, cutouts if pictures else None, int(hold["id"]), words))
    more = len(unsure) - MOST_CUTOUTS
    rest = f"<p>{more} more are marked <code>review</code> in holds.json.</p>" if more > 0 else ""
    intro = "<p>The least certain first. Wrong ones can be corrected in the editor.</p>"
    return section("Holds to review", intro + _tiles(tiles) + rest)


def left_out_section(facts: Facts, cutouts: Path, pictures: bool) -> str:
    """Instances that are not shown as holds, the surest first."""
    if not facts.left_out:
        return ""
    tiles = []
    for row in facts.left_out[:MOST_CUTOUTS]:
        x, y, z = (float(v) for v in row["position"])
        sure = f"{text(row['class'])}, {100 * float(row['score']):.0f} % certain"
        words = f"{sure}, {text(row['reason'])}<br>{x:.2f}, {y:.2f}, {z:.2f}"
        tiles.append(_tile(facts, cutouts if pictures else None, int(row["id"]), words))
    more = len(facts.left_out) - MOST_CUTOUTS
    rest = f"<p>{more} more are in attributes.json.</p>" if more > 0 else ""
    intro = (
        f"<p>{len(facts.left_out)} instances that few photos confirm "
        "(<code>classify.least_score</code>), or that lie flat on the wall "
        "(<code>classify.flat_below</code>) or on a printed plate, are not shown as holds. "
        "To keep one, add its id and place to "
        '<code>holds.edits.json</code>: <code>{"id": 7, "at": [x, y, z], "kept": true}</code>.</p>'
    )
    return section("Left out as doubtful", intro + _tiles(tiles) + rest)
