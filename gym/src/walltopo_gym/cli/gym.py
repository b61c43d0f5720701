"""`walltopo gym`: run and administer the platform."""

from __future__ import annotations

import argparse
import sys

from walltopo_gym.cli import announce, backups, demo, inspections, operator, user
from walltopo_gym.cli.options import add_gym_data_options, in_words, print_help

_EXAMPLES = """\
examples:
  walltopo gym serve --data gym/                       SQLite and files in gym/
  walltopo gym serve --data gym/ --database postgresql://user@host/walls
  walltopo gym user add owner@gym.example --data gym/ --operator
  walltopo gym backup --data gym/ gym.tar              while it serves

Everything that can be set: `walltopo gym settings`; in DIR/gym.toml, or as WALLTOPO_GYM_NAME.
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `gym` command."""
    gym = commands.add_parser(
        "gym",
        help="put a gym's walls online: accounts, uploads, scans, routes",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    gym.set_defaults(run=lambda args: print_help(gym))
    inner = gym.add_subparsers(title="commands", metavar="COMMAND")
    serve = inner.add_parser("serve", help="serve the platform until Ctrl-C")
    add_gym_data_options(serve)
    serve.add_argument("--host", help="address to listen on (default 127.0.0.1)")
    serve.add_argument("--port", help="port to listen on; 0: any free one (default 8080)")
    serve.add_argument("--address", help="the address as people type it, e.g. https://gym.example")
    serve.set_defaults(run=_serve)
    worker = inner.add_parser("worker", help="work on scans, on this or another machine")
    add_gym_data_options(worker)
    worker.set_defaults(run=_worker)
    migrate = inner.add_parser("migrate", help="bring the database to this version (serve does it)")
    add_gym_data_options(migrate)
    migrate.set_defaults(run=_migrate)
    user.register(inner)
    announce.register(inner)
    demo.register(inner)
    operator.register(inner)
    backups.register(inner)
    inspections.register(inner)
    settings = inner.add_parser("settings", help="every setting with its default")
    settings.add_argument("--markdown", action="store_true", help="as the table of the docs")
    settings.set_defaults(run=_settings)
    for command in inner.choices.values():
        command.set_defaults(run=in_words(command.get_default("run")))


_NO_HTTPS = (
    "Nobody can sign in from another device: browsers keep a sign-in over https only. Put a server "
    "with a certificate in front (caddy reverse-proxy --from walls.example --to :8080, or "
    "tailscale serve 8080) and set `address` to its https address."
)


def _serve(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.server.run import serve
    from walltopo_gym.settings import load_settings

    names = ("data", "database", "objects", "host", "port", "address")
    settings = load_settings({name: getattr(args, name) for name in names})

    def tell(address: str) -> None:
        console.print(address, style="bold", soft_wrap=True)
        if not settings.is_secure:
            console.print(_NO_HTTPS, soft_wrap=True, markup=False)
        console.print("Ctrl-C stops.")

    serve(settings, tell)
    return 0


def _worker(args: argparse.Namespace) -> int:
    import logging.config
    import threading

    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options, settings_of
    from walltopo_gym.server.request_log import log_config
    from walltopo_gym.storage.files import open_store
    from walltopo_gym.work import work

    settings = settings_of(args)
    logging.config.dictConfig(log_config(settings.log))
    with database_of_options(args) as database:
        console.print("working on scans; Ctrl-C stops")
        work(settings, database, open_store(settings), threading.Event())
    return 0


def _migrate(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options

    with database_of_options(args):
        console.print("the database is of this version")
    return 0


def _settings(args: argparse.Namespace) -> int:
    from pydantic_core import PydanticUndefined

    from walltopo.cli.console import console
    from walltopo_gym.settings import GymSettings, settings_markdown

    if args.markdown:
        sys.stdout.write(settings_markdown())
        return 0
    for name, field in GymSettings.model_fields.items():
        default = "(must be given)" if field.default is PydanticUndefined else repr(field.default)
        console.print(f"{name} = {default:<30} # {field.description}", soft_wrap=True, markup=False)
    return 0
