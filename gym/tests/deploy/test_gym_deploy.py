"""The files of gym/deploy set only settings and run only commands that exist."""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from walltopo_gym.cli.gym import register
from walltopo_gym.settings import PREFIX, GymSettings, load_settings

DEPLOY = Path(__file__).parents[2] / "deploy"
COMPOSE: dict[str, Any] = yaml.safe_load((DEPLOY / "compose.yaml").read_text())


@pytest.mark.parametrize("file", ["compose.yaml", "Containerfile", "walltopo-gym.service"])
def test_every_setting_is_one(file: str) -> None:
    named = re.findall(rf"{PREFIX}(\w+)", (DEPLOY / file).read_text())
    assert named
    assert {name.lower() for name in named} <= set(GymSettings.model_fields)


def test_the_servers_environment_is_understood(tmp_path: Path) -> None:
    environment = COMPOSE["services"]["server"]["environment"]
    answer = {name: re.sub(r"\$\{\w+:\?\}", "x", value) for name, value in environment.items()}
    settings = load_settings({"data": tmp_path}, answer)
    assert (settings.workers, settings.log, settings.proxies) == (0, "json", ("*",))
    assert settings.database_url == "postgresql+psycopg://gym:x@database/gym"


def test_commands_are_there() -> None:
    parser = argparse.ArgumentParser()
    register(parser.add_subparsers())
    unit = (DEPLOY / "walltopo-gym.service").read_text()
    started = re.findall(r"walltopo gym (\w+)$", unit, flags=re.M)
    for command in (*started, COMPOSE["services"]["worker"]["command"]):
        assert parser.parse_args(["gym", command]).run.__name__ == f"_{command}"


def test_the_unit_is_well_formed(tmp_path: Path) -> None:
    program = shutil.which("systemd-analyze")
    if program is None:
        pytest.skip("no systemd here")
    unit = tmp_path / "walltopo-gym.service"
    text = (DEPLOY / "walltopo-gym.service").read_text()
    unit.write_text(text.replace("/opt/walltopo/bin/walltopo", "/bin/true"))
    ended = subprocess.run([program, "verify", unit], capture_output=True, text=True, check=False)
    assert "walltopo-gym.service" not in ended.stderr, ended.stderr
    # In tenths; higher exposure fails.
    command = [program, "security", "--offline=true", "--threshold=30", str(unit)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout
