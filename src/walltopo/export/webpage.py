"""`index.html` and its assets: the viewer page, which works from a server and from disk.

A page opened from disk may neither fetch files nor load module scripts. So the viewer is one
classic script, and each tier lies there twice: as GLB for servers, and as a script that hands
over the same bytes in base64 for `file://`.
"""

from __future__ import annotations

import base64
import html
import shutil
from importlib import resources
from pathlib import Path

from walltopo.core import EnvironmentLacksError

__all__ = ["write_page", "write_tier"]

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">
<meta name="color-scheme" content="light dark">
<meta name="referrer" content="no-referrer">
<title>{title}</title>
<link rel="icon" href="data:,">
<script src="{assets}/start.js"></script>
<style>
html, body {{ margin: 0; height: 100%; overflow: hidden; }}
html {{ background: light-dark(#eef0f3, #15171b); }}
wall-topo {{ display: block; position: fixed; inset: 0; }}
wall-topo:not(:defined) {{ display: grid; place-content: center; text-align: center;
  font: 15px/1.4 system-ui, sans-serif; color: light-dark(#566070, #a3adbd); }}
wall-topo strong {{ font-size: 19px; font-weight: 650; color: light-dark(#14181f, #eceff4); }}
</style>
</head>
<body>
<wall-topo src="{assets}/first.glb" detail="{assets}/detail.glb" heading="{title}" links>
<strong>{title}</strong> <p>Loading the wall …</p>
</wall-topo>
<script src="{assets}/viewer.js"></script>
<noscript>This page draws the wall with JavaScript; please switch it on.</noscript>
</body>
</html>
"""

# A page from disk may not fetch, so it cannot be told to in the page itself.
START = """\
// Asks for the first tier while the viewer's script is still on its way.
if (location.protocol !== "file:") {
  const link = document.createElement("link");
  link.rel = "preload";
  link.as = "fetch";
  link.crossOrigin = "anonymous";
  link.href = document.currentScript.src.replace(/start\\.js$/, "first.glb");
  document.head.append(link);
}
"""


def viewer_script() -> Path:
    """The built viewer that ships with the package.

    Raises
    ------
    EnvironmentLacksError : the package was installed without it.
    """
    path = Path(str(resources.files("walltopo.export") / "page" / "viewer.js"))
    if not path.is_file():
        raise EnvironmentLacksError(
            f"{path}: the built viewer is missing",
            "In a checkout, build it: cd viewer && npm ci && npm run build.",
        )
    return path


def write_tier(folder: Path, name: str, data: bytes) -> None:
    """Write `<name>.glb` and its twin `<name>.js` for pages opened from disk."""
    (folder / f"{name}.glb").write_bytes(data)
    text = base64.b64encode(data).decode("ascii")
    script = f'(window.wallTopoTiers??={{}})["{name}.glb"]="{text}";\n'
    (folder / f"{name}.js").write_text(script, encoding="ascii")


def write_page(index: Path, folder: Path, title: str) -> None:
    """Write the page and copy the viewer beside the tiers.

    Parameters
    ----------
    index : where the HTML file goes.
    folder : the folder of the tiers, a sibling of `index`.
    """
    shutil.copyfile(viewer_script(), folder / "viewer.js")
    (folder / "start.js").write_text(START, encoding="ascii")
    text = PAGE.format(title=html.escape(title), assets=folder.name)
    index.write_text(text, encoding="utf-8")
