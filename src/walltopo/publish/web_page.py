"""Write `index.html` and its assets: the viewer page, served or opened from disk."""

from __future__ import annotations

import base64
import json
import re
import shutil
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from walltopo.core import EnvironmentLacksError
from walltopo.scans.page_labels import PageLabels

if TYPE_CHECKING:
    from jinja2 import Environment

LABELS = "labels.json"  # beside the tiers


def viewer_script() -> Path:
    """Return the built viewer that comes with the package.

    Raises
    ------
    EnvironmentLacksError : the package was installed without the viewer.
    """
    path = Path(str(resources.files("walltopo.publish") / "page" / "viewer.js"))
    if not path.is_file():
        raise EnvironmentLacksError(
            f"{path}: the built viewer is missing",
            "In a checkout, build it: make viewer.",
        )
    return path


def write_tier(folder: Path, name: str, data: bytes) -> None:
    """Write `<name>.glb` and its twin `<name>.js` for pages opened from disk."""
    (folder / f"{name}.glb").write_bytes(data)
    text = base64.b64encode(data).decode("ascii")
    script = f'(window.wallTopoTiers??={{}})["{name}.glb"]="{text}";\n'
    (folder / f"{name}.js").write_text(script, encoding="ascii")


def write_labels(folder: Path, labels: PageLabels) -> None:
    """Write `labels.json` and its twin `labels.js` for pages opened from disk."""
    text = json.dumps(msgspec.to_builtins(labels), ensure_ascii=False, separators=(",", ":"))
    (folder / LABELS).write_text(text, encoding="utf-8")
    script = f'(window.wallTopoTiers??={{}})["{LABELS}"]={text};\n'
    (folder / "labels.js").write_text(script, encoding="utf-8")


def write_page(index: Path, folder: Path, title: str, moves: bool = False) -> None:
    """Write the page and copy the viewer beside the tiers.

    Parameters
    ----------
    index : path of the HTML file.
    folder : the folder of the tiers, a sibling of `index`.
    moves : whether `moves.json` lies beside the page.
    """
    script = viewer_script()
    shutil.copyfile(script, folder / "viewer.js")
    shutil.copyfile(script.with_name("start.js"), folder / "start.js")
    names = ("start.js", "first.glb", "detail.glb", "viewer.js")
    start, first, detail, viewer = (f"{folder.name}/{name}" for name in names)
    text = render(
        "page",
        "index.html.jinja",
        title=title,
        start=start,
        first=first,
        detail=detail,
        viewer=viewer,
        moves=moves,
    )
    index.write_text(text, encoding="utf-8")


def write_single_page(path: Path, title: str, first: bytes, detail: bytes) -> None:
    """Write the page as one self-contained HTML file.

    Parameters
    ----------
    first, detail : the tiers, as GLB.
    """
    text = render(
        "page",
        "index.html.jinja",
        title=title,
        start="",
        first=_data_url(first),
        detail=_data_url(detail),
        viewer="",
        moves=False,
        code=_escape_script(viewer_script().read_text(encoding="utf-8")),
    )
    path.write_text(text, encoding="utf-8")


def _data_url(data: bytes) -> str:
    return "data:model/gltf-binary;base64," + base64.b64encode(data).decode("ascii")


def _escape_script(script: str) -> str:
    """Return a script escaped for the inside of a `<script>` element.

    The escapes are equivalent in strings and regular expressions, where such text occurs.
    """
    return re.sub(r"<(?=/script|!--|script)", r"\\x3c", script, flags=re.IGNORECASE)


def number(value: float | None, digits: int = 1, unit: str = "") -> str:
    """Return a figure with its unit and thousands separators; an en dash for None or NaN."""
    if value is None or value != value:
        return "–"
    shown = f"{value:,.{digits}f}" if isinstance(value, float) else f"{value:,}"
    return f"{shown} {unit}".rstrip()


@cache
def _environment(folder: str) -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("walltopo.publish", folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["number"] = number
    return environment


def render(folder: str, template: str, **values: Any) -> str:
    """Return the text of a template of this package.

    Parameters
    ----------
    folder : folder of the template, relative to `walltopo/publish`.
    values : the variables of the template.
    """
    return _environment(folder).get_template(template).render(**values)
