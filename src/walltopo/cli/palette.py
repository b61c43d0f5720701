"""`walltopo palette`: write the colours of a gym to a file that a setter can edit."""

from __future__ import annotations

import argparse
from pathlib import Path

from walltopo.cli.options import add_overwrite, output_target

_EXAMPLE = """examples:
  walltopo palette learn gym3                 # writes gym3/palette.toml
  walltopo palette learn gym3 --out gym.toml
then rename colours in the file and give it to the next scan:
  walltopo scan photos/ gym4 --set classify.palette=gym.toml
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `palette` command."""
    parser = commands.add_parser(
        "palette",
        help="write a gym's colours to an editable file",
        description="Write the colours of a gym, found by clustering its holds, to a palette.toml.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    learn = actions.add_parser(
        "learn",
        help="write the palette of a classified scan",
        description="Write the colours of a scan's holds, with the number of holds of each.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    learn.add_argument("scan", type=Path, help="scan folder")
    learn.add_argument("--out", type=Path, help="file to write (default SCAN/palette.toml)")
    add_overwrite(learn, "--force")
    learn.set_defaults(run=run_learn)


def run_learn(args: argparse.Namespace) -> int:
    """Write the palette; return exit code 0."""
    from walltopo.cli.console import console
    from walltopo.core import InputError
    from walltopo.core.outputs import written_file
    from walltopo.describe.classify.palette import palette_of_holds, write_palette
    from walltopo.describe.matching.inventory import load_scan

    scan, holds, *_ = load_scan(args.scan)
    out = args.out or scan.root / "palette.toml"
    with written_file(output_target(args, out, "palette learn", flag="--out")) as made:
        entries, counts = palette_of_holds(holds)
        if not entries:
            raise InputError(f"{scan.holds}: no hold has a colour", "The palette would be empty.")
        write_palette(made, entries, counts)
    names = ", ".join(f"{e.name} ({n})" for e, n in zip(entries, counts, strict=True))
    console.print(f"{out}: {len(entries)} colours: {names}")
    return 0
