"""Putting the report's sections together."""

from __future__ import annotations

from walltopo.core import Progress
from walltopo.export.contract import ExportSettings
from walltopo.export.report import sections
from walltopo.export.report.facts import Facts, read_facts
from walltopo.export.report.maps import Maps, draw_maps
from walltopo.export.report.markup import section, text
from walltopo.export.tiers import Look
from walltopo.export.wall import Wall
from walltopo.scans.folder import ScanFolder
from walltopo.core.files import atomic_path

__all__ = ["write_report"]

STYLE = """
:root{color-scheme:light dark;--paper:#fff;--ground:#eef0f3;--text:#14181f;--quiet:#566070;
--line:#dde1e8;--accent:#1f5fd0;--good:#17683a;--warn:#8f4a00}
@media (prefers-color-scheme:dark){:root{--paper:#1e2127;--ground:#15171b;--text:#eceff4;
--quiet:#a3adbd;--line:#343a45;--accent:#8ab4ff;--good:#7ed6a0;--warn:#ffb870}}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--text);
font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans",sans-serif}
main{max-width:1040px;margin:0 auto;padding:28px 16px 60px}
header a{color:var(--accent)}
h1{margin:0;font-size:28px;letter-spacing:-.02em;overflow-wrap:anywhere}
h2{margin:0 0 10px;font-size:19px}h3{margin:18px 0 8px;font-size:15px}
p{margin:6px 0}header p{color:var(--quiet);margin:4px 0 18px}
section{background:var(--paper);border:1px solid var(--line);border-radius:14px;padding:18px 20px;
margin-top:16px}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(140px,1fr));gap:12px}
.card{background:var(--paper);border:1px solid var(--line);border-radius:14px;padding:12px 16px}
.card b{display:block;font-size:22px;font-weight:640;letter-spacing:-.01em}
.card span{color:var(--quiet);font-size:13.5px}.card.good b{color:var(--good)}
.card.warn b{color:var(--warn)}
.wide{overflow-x:auto}table{border-collapse:collapse;width:100%;margin:4px 0}
th,td{text-align:left;padding:6px 12px 6px 0;border-bottom:1px solid var(--line);font-size:14.5px;
vertical-align:middle}
th{color:var(--quiet);font-weight:540;font-size:13px}
.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
figure{margin:16px 0 0}.sheet{position:relative;border-radius:10px;overflow:hidden;
background:#f5f6f8}
.sheet img{display:block;width:100%;height:auto}.sheet svg{position:absolute;inset:0;width:100%;
height:100%}
figcaption{color:var(--quiet);font-size:13.5px;margin-top:6px}
.path{fill:none;stroke:#1f5fd0;stroke-width:1.5;opacity:.45}
.look{stroke:#14181f;stroke-width:1.6}.eye{fill:#1f5fd0;stroke:#fff;stroke-width:1.5}
circle.spot{fill:#14181f;stroke:#fff;stroke-width:2.5}
text.spot{fill:#fff;font-size:18px;font-weight:640;text-anchor:middle}
.legend{display:flex;flex-wrap:wrap;gap:4px 14px}.legend span{display:inline-flex;gap:6px;
align-items:center}
.legend i{width:14px;height:14px;border-radius:3px}
.tiles{list-style:none;margin:0;padding:0;display:grid;gap:12px;
grid-template-columns:repeat(auto-fill,minmax(180px,1fr))}
.tiles.small{grid-template-columns:repeat(auto-fill,minmax(110px,1fr))}
.tiles li{border:1px solid var(--line);border-radius:10px;padding:8px;font-size:13px;
overflow-wrap:anywhere}
.tiles img{display:block;width:100%;height:130px;object-fit:cover;border-radius:6px;
margin-bottom:6px}
.tiles.small img,.blank{display:block;height:84px;object-fit:contain;margin-bottom:6px;
border-radius:6px;background:#c9ced6}
.tiles span{display:block;color:var(--quiet)}
.dot{display:inline-block;width:12px;height:12px;border-radius:50%;margin-right:7px;
vertical-align:-1px;box-shadow:inset 0 0 0 1px rgb(0 0 0/25%)}
.bar{display:block;width:100%;min-width:90px;height:8px;border-radius:4px;background:var(--line)}
.bar i{display:block;height:100%;border-radius:4px;background:var(--accent)}
@media print{body{background:#fff}section{break-inside:avoid}}
"""


def _page(
    wall: Wall, facts: Facts, maps: Maps | None, scan: ScanFolder, settings: ExportSettings
) -> str:
    title = text(wall.title)
    sizes = {p.name: p.stat().st_size for p in (scan.glb,) if p.is_file()}
    spots = len(maps.spots) if maps else 0
    body = [
        sections.figures_of_merit(wall, facts, maps.covered if maps else None),
        sections.attention(wall, facts, spots),
        sections.photo_section(facts, scan.photos, maps.path if maps else ""),
        section("Coverage", maps.coverage) if maps else "",
        sections.measure_section(facts),
        sections.route_section(wall),
        sections.review_section(wall, facts, scan.cutouts, settings.thumbnails),
        sections.left_out_section(facts, scan.cutouts, settings.thumbnails),
        sections.step_section(wall, facts, sizes),
    ]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<title>{title}: report</title><link rel="icon" href="data:,"><style>{STYLE}</style>'
        f"</head><body><main><header><h1>{title}</h1>"
        f'<p>Scan report · <a href="{scan.page.name}">open the wall</a></p></header>'
        f"{''.join(body)}</main></body></html>\n"
    )


def write_report(
    scan: ScanFolder, wall: Wall, first: Look, settings: ExportSettings, progress: Progress
) -> None:
    """Write `report.html`: one file that needs no other, and asks no other host for anything.

    Parameters
    ----------
    first : the first tier, which the pictures are drawn from.
    """
    facts = read_facts(scan)
    maps = None
    if facts.views:
        maps = draw_maps(first, facts.views, wall.holds, wall.metric)
    else:
        progress.note("report: no camera positions, so no camera path and no coverage map")
    with atomic_path(scan.report) as temporary:
        temporary.write_text(_page(wall, facts, maps, scan, settings), encoding="utf-8")
