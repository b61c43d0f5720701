"""`walltopo gym inspections`: list, export and verify records of inspections."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from walltopo.core import InputError
from walltopo_gym.cli.options import add_gym_data_options, print_help


def register(inner: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the commands of inspections."""
    inspections = inner.add_parser(
        "inspections", help="list, export and verify records of inspections"
    )
    inspections.set_defaults(run=lambda args: print_help(inspections))
    commands = inspections.add_subparsers(title="commands", metavar="COMMAND")
    listed = commands.add_parser("list", help="the last 200 inspections of a gym")
    listed.add_argument("gym", metavar="GYM", help="its name in addresses")
    add_gym_data_options(listed)
    listed.set_defaults(run=_list)
    export = commands.add_parser("export", help="write all finished inspections of a gym")
    export.add_argument("gym", metavar="GYM", help="its name in addresses")
    export.add_argument("folder", type=Path, metavar="FOLDER", help="of a JSON file for each")
    add_gym_data_options(export)
    export.set_defaults(run=_export)
    verify = commands.add_parser(
        "verify", help="check the signature of an exported record; needs no server"
    )
    verify.add_argument("file", type=Path, metavar="FILE.json")
    verify.set_defaults(run=_verify)


def _list(args: argparse.Namespace) -> int:
    from walltopo_gym.cli.gym_data import (
        check_there,
        database_of_options,
        gym_named,
        settings_of,
    )
    from walltopo_gym.inspections.models import Inspection
    from walltopo_gym.inspections.service import inspections_of

    check_there(settings_of(args))
    with database_of_options(args) as database, database.reading() as session:
        rows = inspections_of(gym_named(session, args.gym)).order_by(Inspection.created_at.desc())
        for row in session.scalars(rows.limit(200)):
            end = "not finished" if row.finished_at is None else f"{row.result} {row.code}"
            _print(f"{row.created_at:%Y-%m-%d} {row.level:<12} {row.id} {end}")
    return 0


def _export(args: argparse.Namespace) -> int:
    from walltopo.core.files import atomic_path
    from walltopo_gym.cli.gym_data import (
        check_there,
        database_of_options,
        gym_named,
        settings_of,
    )
    from walltopo_gym.inspections.models import Inspection
    from walltopo_gym.inspections.record import record_file
    from walltopo_gym.inspections.service import inspections_of

    check_there(settings_of(args))
    args.folder.mkdir(parents=True, exist_ok=True)
    number = 0
    with database_of_options(args) as database, database.reading() as session:
        rows = inspections_of(gym_named(session, args.gym)).where(Inspection.record != "")
        for row in session.scalars(rows.order_by(Inspection.finished_at)).yield_per(20):
            text = json.dumps(record_file(session, row), ensure_ascii=False, indent=1)
            name = f"{row.finished_at:%Y-%m-%d}-{row.level}-{row.code}.json"
            with atomic_path(args.folder / name) as path:
                path.write_text(text + "\n", encoding="utf-8")
            number += 1
    _print(f"{args.folder}: {number} records")
    return 0


def _verify(args: argparse.Namespace) -> int:
    from walltopo_gym.inspections.paper import spaced_code
    from walltopo_gym.inspections.record import check_file
    from walltopo_gym.inspections.signing import key_name

    try:
        found = check_file(args.file.read_bytes())
    except (OSError, ValueError) as error:
        hint = "Give a file of *Export JSON* or of `walltopo gym inspections export`."
        raise InputError(f"{args.file}: no record of an inspection", hint) from error
    if found is None:
        _print(f"{args.file}: the record or its signature was changed")
        return 1
    record = found.record
    _print(f"{args.file}: signed by the key {key_name(found.public_key)}")
    _print(f"{record['gym']['name']}, {record['level']}, {record['finished']['at'][:10]}")
    _print(f"result: {record['result']}, by {record['finished']['by']}")
    _print(f"code: {spaced_code(found.code)}; the paper and the server's page show the same")
    return 0


def _print(text: str) -> None:
    from walltopo.cli.console import console

    console.print(text, soft_wrap=True, markup=False, highlight=False)
