"""Build the input folder of the site: pages of `docs/`, pages beside the code, generated pages.

    python -m tools.pages.staging build/site

Pages keep their places in the repository; in the site they are in one folder. Links that
lead out of `docs/` are therefore converted. A link to a file that is not in the site is an
error.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import re
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from tools.pages.commands import commands_page
from walltopo.core import InputError

# Pages outside `docs/`, and their names in the site.
ELSEWHERE = {
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "SECURITY.md": "reporting.md",
    "examples/demo-photos.md": "demo-photos.md",
    "src/walltopo/models/README.md": "model-cards.md",
    "features/README.md": "larger-features.md",
    "lab/README.md": "lab.md",
    "gym/deploy/README.md": "deploy.md",
    "viewer/README.md": "component.md",
}
# The repository's README maps to the site's own start page.
ALSO = {"README.md": "index.md"}
# Files that pages show or offer for download.
FILES = {
    "src/walltopo/publish/page/viewer.js": "demo/viewer.js",
    "LICENSE": "LICENSE.txt",
}
LINK = re.compile(r"(?<=\]\()(?!\w+:|#|/)([^)\s#]+)")
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)


def stage(root: Path, out: Path) -> None:
    """Assemble the input folder of the site generator.

    Parameters
    ----------
    root : the checkout.
    out : the output folder; its previous content is deleted.

    Raises
    ------
    InputError : a page links to a file of the checkout that is not in the site.
    """
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(root / "docs", out)
    for file, name in FILES.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(root / file, out / name)
    places = {f"docs/{path.relative_to(root / 'docs')}" for path in (root / "docs").rglob("*")}
    pages = {name: name.removeprefix("docs/") for name in places} | ELSEWHERE
    site = pages | FILES | ALSO
    for source, name in pages.items():
        if name.endswith(".md"):
            text = (root / source).read_text(encoding="utf-8")
            (out / name).write_text(_turned(text, source, name, site), encoding="utf-8")
    (out / "commands.md").write_text(commands_page(), encoding="utf-8")
    (out / "gym-settings.md").write_text(_output("gym", "settings", "--markdown"), encoding="utf-8")


def _turned(text: str, source: str, name: str, site: dict[str, str]) -> str:
    """Return the page with its links converted to paths in the site."""

    def turn(found: re.Match[str]) -> str:
        target = os.path.normpath(os.path.join(os.path.dirname(source), found[1]))
        if target not in site:
            raise InputError(
                f"{source}: links to {found[1]}, which is not in the site",
                "Add it to tools.pages.staging, or name it without a link.",
            )
        return os.path.relpath(site[target], os.path.dirname(name))

    parts = FENCE.split(text)
    fences = [*FENCE.findall(text), ""]
    return "".join(LINK.sub(turn, part) + fence for part, fence in zip(parts, fences, strict=True))


def _output(*words: str) -> str:
    """Return the output of a `walltopo` command."""
    from walltopo.cli import main as walltopo

    with contextlib.redirect_stdout(io.StringIO()) as output:
        if walltopo(list(words)) != 0:
            raise InputError(f"`walltopo {' '.join(words)}` failed")
    return output.getvalue()


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    parser.add_argument("--root", type=Path, default=Path())
    args = parser.parse_args(arguments)
    stage(args.root, args.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
