"""The Tab key offers commands, options and values, as bash itself lists them."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from walltopo.cli import build_parser, main

ASK = """
source {script}
COMP_WORDS=({words})
COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
COMP_LINE="${{COMP_WORDS[*]}}"
COMP_POINT=${{#COMP_LINE}}
$(complete -p walltopo | sed 's/.*-F \\([^ ]*\\).*/\\1/')
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "walltopo"
    command = [sys.executable, "-m", "walltopo", "completion", "bash"]
    path.write_text(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return path


def _offered(script: Path, words: str, folder: Path) -> set[str]:
    requests = ASK.format(script=script, words=words)
    command = ["bash", "--norc", "-c", requests]
    run = subprocess.run(command, capture_output=True, text=True, cwd=folder, check=True)
    assert run.stderr == ""
    return set(run.stdout.split())


needs_bash = pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")


@needs_bash
def test_commands_are_offered(script: Path, tmp_path: Path) -> None:
    assert _offered(script, "walltopo ex", tmp_path) == {"export"}
    assert {"scan", "view", "train"} <= _offered(script, 'walltopo ""', tmp_path)


@needs_bash
def test_the_options_of_every_command(script: Path, tmp_path: Path) -> None:
    commands = next(
        a for a in build_parser()._actions if isinstance(a, argparse._SubParsersAction)
    ).choices
    for name in ("scan", "export", "train", "lift"):
        wanted = {o for o in commands[name]._option_string_actions if o.startswith("--")}
        assert len(wanted) > 3
        assert wanted <= _offered(script, f"walltopo {name} --", tmp_path)


@needs_bash
def test_values_and_files(script: Path, tmp_path: Path) -> None:
    (tmp_path / "wall").mkdir()
    assert "csv" in _offered(script, 'walltopo export --format ""', tmp_path)
    assert "wall" in _offered(script, "walltopo view wa", tmp_path)
    assert {"scan", "detector"} <= _offered(script, 'walltopo evaluate ""', tmp_path)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell(shell: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    output = capsys.readouterr().out
    for word in ("export", "accept-changes", "evaluate", "painted-ply"):
        assert word in output
    if shutil.which(shell):
        (tmp_path / "script").write_text(output)
        subprocess.run([shell, "-n", str(tmp_path / "script")], check=True)
