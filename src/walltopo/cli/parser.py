"""The parser of all commands: argparse, with messages that are safe to show."""

from __future__ import annotations

import argparse
from typing import NoReturn


class Parser(argparse.ArgumentParser):
    """An `ArgumentParser` that writes out control characters of what was typed."""

    def error(self, message: str) -> NoReturn:
        from walltopo.cli.console import visible

        super().error(visible(message))
