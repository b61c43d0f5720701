"""No other local user can read the files of the platform's user."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.server.app import open_services
from walltopo_gym.settings import load_settings


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize("there", [False, True])
def test_only_its_user_can_enter_the_data_folder(tmp_path: Path, *, there: bool) -> None:
    data = tmp_path / "gym"
    if there:
        data.mkdir(mode=0o755)
    open_services(load_settings({"data": data}, {})).close()
    assert mode(data) == 0o700
    data.chmod(0o755)
    with lock_data_folder(data):
        assert mode(data) == 0o700
