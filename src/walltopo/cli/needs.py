"""What a command wants beyond the core: told before the work, not when it comes to be used."""

from __future__ import annotations

import argparse
import importlib.util
from collections.abc import Callable, Mapping

# Module that is imported to what pip installs for it, such as "torch": "walltopo-lab[train]".
Needs = Mapping[str, str]


def add_needs(
    parser: argparse.ArgumentParser, needs: Needs | Callable[[argparse.Namespace], Needs]
) -> None:
    """Let `main` check, before the command runs, that these modules are here.

    Parameters
    ----------
    needs : or a function of the arguments, where only some uses of the command want them.
    """
    parser.set_defaults(needs=needs if callable(needs) else lambda _: needs)


def check_needs(args: argparse.Namespace) -> None:
    """Whether the modules of the command can be found; imports none.

    Raises
    ------
    EnvironmentLacksError : names those that are missing, and what to install.
    """
    if not hasattr(args, "needs"):
        return
    from walltopo.core import EnvironmentLacksError

    needs: Needs = args.needs(args)
    missing = [name for name in needs if importlib.util.find_spec(name) is None]
    if missing:
        wanted = " ".join(f"'{what}'" for what in dict.fromkeys(needs[name] for name in missing))
        raise EnvironmentLacksError(
            f"`walltopo {args.command}` needs {', '.join(missing)} for this, which "
            f"{'is' if len(missing) == 1 else 'are'} not installed here; nothing was begun",
            f"pip install {wanted}",
        )
