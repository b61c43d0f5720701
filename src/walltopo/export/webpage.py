"""`index.html` and its assets: the viewer page, which works from a server and from disk.

A page opened from disk may neither fetch files nor load module scripts. So the viewer is one
classic script, and each tier lies there twice: as GLB for servers, and as a script that hands
over the same bytes in base64 for `file://`.
"""

from __future__ import annotations

import base64
import shutil
from importlib import resources
from pathlib import Path

from walltopo.core import EnvironmentLacksError
from walltopo.export.templating import render

__all__ = ["write_page", "write_tier"]


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
    script = viewer_script()
    shutil.copyfile(script, folder / "viewer.js")
    shutil.copyfile(script.with_name("start.js"), folder / "start.js")
    text = render("page", "index.html.jinja", title=title, assets=folder.name)
    index.write_text(text, encoding="utf-8")
