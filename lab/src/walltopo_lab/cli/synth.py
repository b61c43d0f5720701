"""`walltopo synth`: generate gyms with exact ground truth."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from walltopo.cli.options import (
    MAX_SEED,
    Number,
    add_needs,
    add_overwrite,
    option_help,
    output_target,
)
from walltopo.core import SettingsError, settings_of
from walltopo.core.settings import unknown_setting
from walltopo_lab.extras import SHAPES
from walltopo_lab.synth.params import PRESETS, GymSettings, PhotoSettings, gym_preset

_EXAMPLE = """example:
  walltopo synth gym3 --preset modern --seed 3 --photos 24 --size 1600x1200
  walltopo synth gym3-reset --reset-of gym3 --reset-seed 8 --reset-part left --photos 16
  walltopo synth gym3-later --wear-of gym3 --wear-seed 9
"""
_TYPES: dict[type, Any] = {int: int, float: float, str: str}
# Settings with their own option; all others need --set key=value.
_GYM_OPTIONS = ("walls", "width", "height", "routes", "volumes", "plates")


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `synth` command."""
    parser = commands.add_parser(
        "synth",
        help="generate a climbing gym: photos with exact ground truth",
        description="Build a gym from a seed and photograph it. Writes photos/ and truth/ "
        "(gt.npz, scene.json, masks.json, cameras/). Run again to resume.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("out", type=Path, help="folder to write")
    add_overwrite(parser)
    seed = Number(int, low=0, high=MAX_SEED)
    parser.add_argument("--preset", choices=tuple(PRESETS), default=None, help="kind of gym")
    parser.add_argument("--seed", type=seed, default=None, help="decides everything (default 0)")
    parser.add_argument("--photos", type=Number(int, low=1), default=None, help="number of photos")
    parser.add_argument("--size", default=None, metavar="WxH", help="size of a photo in pixels")
    for key in _GYM_OPTIONS:
        field = settings_of(GymSettings)[key]
        parser.add_argument(
            f"--wall-{key}" if key in ("width", "height") else f"--{key}",
            dest=f"gym_{key}",
            type=Number(type(field.default), field.low, field.high),
            default=None,
            help=option_help(field, field.default),
        )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="changes",
        help="any other setting of the gym or the photos (repeatable); --list names them",
    )
    parser.add_argument("--list", action="store_true", help="list the settings and stop")
    parser.add_argument("--photo-seed", type=seed, default=None, help="another walk, same gym")
    parser.add_argument(
        "--reset-of",
        type=Path,
        default=None,
        metavar="DIR",
        help="the gym of DIR after a reset of routes",
    )
    parser.add_argument("--reset-seed", type=seed, default=None, help="seed of the new routes")
    parser.add_argument(
        "--reset-part",
        choices=("all", "left", "middle", "right"),
        default="all",
        help="where routes are replaced",
    )
    parser.add_argument(
        "--wear-of",
        type=Path,
        default=None,
        metavar="DIR",
        help="the gym of DIR weeks later: some holds turned, shifted or gone",
    )
    parser.add_argument("--wear-seed", type=seed, default=None, help="decides which holds")
    parser.add_argument(
        "--holds",
        type=Path,
        default=None,
        metavar="DIR",
        help="use the scanned holds (OBJ, GLB, PLY, STL) of DIR",
    )
    parser.set_defaults(run=run)
    add_needs(parser, lambda args: {} if args.list else SHAPES)


def run(args: argparse.Namespace) -> int:
    """Generate the gym and return exit code 0."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener

    if args.list:
        _list_settings()
        return 0
    from walltopo.core.outputs import claimed_folder
    from walltopo_lab.synth.recipe import generate

    recipe = _recipe_of(args)
    claimed_folder(output_target(args, args.out, "synth", flag="OUT"))
    with TerminalListener(console) as listener:
        result = generate(args.out, recipe, listener)
    console.print(
        f"{args.out}: {result['photos']} photos ({result['rendered']} rendered now), "
        f"{result['instances']} instances, {result['routes']} routes"
    )
    return 0


def _list_settings() -> None:
    from walltopo.cli.console import console

    for title, kind in (("gym", GymSettings), ("photos", PhotoSettings)):
        console.print(title, style="bold")
        for field in settings_of(kind).values():
            key = f"photo.{field.name}" if kind is PhotoSettings else field.name
            unit = f" [{field.unit}]" if field.unit else ""
            console.print(f"  {key} = {field.default!r}{unit}  {field.text}")


def _recipe_of(args: argparse.Namespace) -> Any:
    """Return the recipe that the options specify."""
    from walltopo_lab.synth.recipe import Recipe

    base = _base_gym(args)
    if base is not None:
        gym, photo, seed, preset = base.gym, base.photos, base.seed, base.preset
    else:
        preset, seed = args.preset or "modern", args.seed or 0
        gym, photo = gym_preset(preset)
    changes = {
        key: getattr(args, f"gym_{key}")
        for key in _GYM_OPTIONS
        if getattr(args, f"gym_{key}") is not None
    }
    photo_changes: dict[str, Any] = {}
    if args.photos is not None:
        photo_changes["photos"] = args.photos
    if args.size is not None:
        photo_changes["width"], photo_changes["height"] = _size(args.size)
    for change in args.changes:
        _apply_setting(change, changes, photo_changes)
    photo_seed = args.photo_seed
    if photo_seed is None and base is not None:
        photo_seed = args.reset_seed if args.wear_of is None else args.wear_seed
    return Recipe(
        dataclasses.replace(gym, **changes),
        dataclasses.replace(photo, **photo_changes),
        seed,
        preset,
        args.reset_seed,
        args.reset_part,
        photo_seed,
        None if args.holds is None else str(args.holds),
        args.wear_seed,
    )


def _base_gym(args: argparse.Namespace) -> Any:
    """Return the recipe of the gym before a reset or before wear; None for a new gym."""
    from walltopo_lab.synth.recipe import read_recipe

    if args.reset_of is not None and args.wear_of is not None:
        raise SettingsError("give --reset-of or --wear-of, not both")
    for option, seed_option, base, seed in (
        ("--reset-of", "--reset-seed", args.reset_of, args.reset_seed),
        ("--wear-of", "--wear-seed", args.wear_of, args.wear_seed),
    ):
        if base is None:
            if seed is not None:
                raise SettingsError(f"{seed_option} needs {option} DIR")
            continue
        if args.preset is not None or args.seed is not None:
            raise SettingsError(f"{option} takes preset and seed from DIR; leave them out")
        if seed is None:
            raise SettingsError(f"{option} needs {seed_option} N")
        return read_recipe(base)
    return None


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit()):
        raise SettingsError(f"--size: expected WIDTHxHEIGHT such as 1600x1200, got {text!r}")
    return int(width), int(height)


def _apply_setting(change: str, gym: dict[str, Any], photo: dict[str, Any]) -> None:
    """Put `key=value` or `photo.key=value` into its settings, converted to the field's type."""
    key, equals, value = change.partition("=")
    key = key.strip()
    target, kind = (photo, PhotoSettings) if key.startswith("photo.") else (gym, GymSettings)
    name = key.removeprefix("photo.")
    fields = settings_of(kind)
    if not equals:
        raise SettingsError(f"--set {change}: expected KEY=VALUE")
    if name not in fields:
        raise unknown_setting(name, fields, "--set", "`walltopo synth x --list` names them.")
    default: Any = fields[name].default
    try:
        if isinstance(default, bool):
            target[name] = {"true": True, "false": False}[value.strip().lower()]
        else:
            target[name] = _TYPES[type(default)](value.strip())
    except (ValueError, KeyError) as error:
        raise SettingsError(
            f"--set {key}: expected a {type(default).__name__}, got {value.strip()!r}"
        ) from error
