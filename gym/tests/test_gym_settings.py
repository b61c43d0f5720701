"""Settings: which one counts, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from walltopo.core import InputError, SettingsError
from walltopo_gym.settings import load_settings


def test_the_command_line_counts_over_the_environment_over_the_file(tmp_path: Path) -> None:
    (tmp_path / "gym.toml").write_text('port = 1\nhost = "file"\nsession_days = 3\n')
    environment = {"WALLTOPO_GYM_PORT": "2", "WALLTOPO_GYM_HOST": "environment", "OTHER": "x"}
    settings = load_settings({"data": tmp_path, "port": 3, "database": None}, environment)
    assert (settings.port, settings.host, settings.session_days) == (3, "environment", 3)
    assert settings.database_url.startswith("sqlite:///")


def test_a_misspelt_name_is_refused_wherever_it_stands(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="session_days"):
        load_settings({"data": tmp_path}, {"WALLTOPO_GYM_SESION_DAYS": "3"})
    (tmp_path / "gym.toml").write_text("prot = 80\n")
    with pytest.raises(SettingsError, match="port"):
        load_settings({"data": tmp_path}, {})


def test_impossible_values_and_files_are_reported(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="port"):
        load_settings({"data": tmp_path}, {"WALLTOPO_GYM_PORT": "many"})
    with pytest.raises(SettingsError, match="--data"):
        load_settings({}, {})
    (tmp_path / "gym.toml").write_text("port = \n")
    with pytest.raises(InputError, match="TOML"):
        load_settings({"data": tmp_path}, {})


@pytest.mark.parametrize("spelled", ["postgres://u@h/d", "postgresql://u@h/d"])
def test_postgresqls_own_spelling_is_understood(tmp_path: Path, spelled: str) -> None:
    settings = load_settings({"data": tmp_path, "database": spelled}, {})
    assert settings.database_url == "postgresql+psycopg://u@h/d"


@pytest.mark.parametrize("url", ["walls", "mysql://a@b/c", "sqlite://", "/dev/full", "sqlite:///"])
def test_a_database_of_another_kind_is_refused_in_words(tmp_path: Path, url: str) -> None:
    with pytest.raises(SettingsError, match="expected a URL"):
        load_settings({"data": tmp_path, "database": url}, {})


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_file_of_windows_notepad_is_read(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "gym.toml").write_text("port = 8123\n", encoding)
    assert load_settings({"data": tmp_path}, {}).port == 8123
