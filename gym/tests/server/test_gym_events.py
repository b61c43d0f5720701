"""Events and questions: who listens hears of a change in its transaction, and can undo it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from uuid import UUID, uuid4

import pytest
from gym.tests.worlds import Server
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.events import GymEvent, Question, collect_answers, publish_event
from walltopo_gym.features import FEATURES, NAMES, listeners_of
from walltopo_gym.gyms.models import Gym

_GYM = Path(__file__).parents[2]


@dataclass(frozen=True)
class Painted(GymEvent):
    colour: str


@dataclass(frozen=True)
class Colours(Question[str]):
    gym: UUID


def test_listeners_hear_in_order_and_answer(tmp_path: Path) -> None:
    heard: list[str] = []
    gym = uuid4()

    def first(session: Session, event: Painted) -> None:
        heard.append(f"first {event.colour}")

    def second(session: Session, event: Painted) -> None:
        heard.append(f"second {event.colour}")

    def answer(session: Session, question: Colours) -> None:
        question.found.append("red" if question.gym == gym else "none")

    database = Database(
        f"sqlite:///{tmp_path / 'a.sqlite'}", {Painted: (first, second), Colours: (answer, answer)}
    )
    with database.reading() as session:
        publish_event(session, Painted(gym, "red"))
        assert heard == ["first red", "second red"]
        assert collect_answers(session, Colours(gym)) == ["red", "red"]
        assert collect_answers(session, Colours(uuid4())) == ["none", "none"]
    database.close()


def test_an_error_of_a_listener_undoes_the_change(server: Server) -> None:
    def fail(session: Session, event: Painted) -> None:
        raise OSError("no paint")

    database = Database(server.database.url, {Painted: (fail,)})
    slug = f"gym-{uuid4().hex[:8]}"

    def change() -> None:
        with database.writing() as session:
            session.add(Gym(name="Wet", slug=slug, created_at=now()))
            session.flush()
            publish_event(session, Painted(uuid4(), "red"))

    with pytest.raises(OSError, match="no paint"):
        change()
    with database.reading() as session:
        assert session.scalar(select(Gym).where(Gym.slug == slug)) is None
    database.close()


def test_data_is_cared_for_while_a_feature_is_off() -> None:
    off = listeners_of(())
    for feature in FEATURES:
        for kind, listeners in feature.data_listeners.items():
            assert set(listeners) <= set(off[kind])
        if feature.switch is not None:
            for kind, listeners in feature.listeners.items():
                assert not set(listeners) & set(off.get(kind, ()))


def test_every_feature_is_in_the_list() -> None:
    found = {path.parent.name for path in (_GYM / "src/walltopo_gym").glob("*/feature.py")}
    assert found == set(NAMES)
    assert list(NAMES) == sorted(NAMES)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["insights", "reset_plans"])
def test_a_feature_can_be_deleted(name: str, tmp_path: Path) -> None:
    """Its folder, its line in the list and its tests: the platform starts and the tests of other
    slices pass."""
    package = tmp_path / "src/walltopo_gym"
    shutil.copytree(_GYM / "src/walltopo_gym", package)
    shutil.copytree(_GYM / "tests", tmp_path / "gym/tests")
    shutil.rmtree(package / name)
    shutil.rmtree(tmp_path / "gym/tests" / name)
    listed = package / "features.py"
    listed.write_text(listed.read_text().replace(f'    "{name}",\n', ""))
    for file in ("conftest.py", "pyproject.toml"):
        shutil.copy(_GYM.parent / file, tmp_path / file)
    tests = [f"gym/tests/{one}" for one in ("gyms", "walls", "notifications")]
    paths = f"{tmp_path / 'src'}:{tmp_path}:{_GYM.parent}"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-m", "not slow", *tests],
        env=os.environ | {"PYTHONPATH": paths},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
