"""The parts of an optional feature of the platform. Only `features.py` imports features."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from threading import Event
from typing import TYPE_CHECKING, Any

from walltopo_gym.database.engine import Database, Listeners
from walltopo_gym.settings import GymSettings, Switch
from walltopo_gym.storage.files import FileStore

if TYPE_CHECKING:
    from fastapi import APIRouter

    from walltopo_gym.jobs.queue import Task
    from walltopo_gym.jobs.worker import Chore


def _nothing(*_: Any) -> Sequence[Any]:
    return ()


@dataclass(frozen=True)
class Feature:
    """An optional part of the platform. Functions import what a command does not need.

    Parameters
    ----------
    name : of its folder.
    switch : the name by which operators and gyms turn it off; None: it is always on.
    listeners : of events and questions, while it is on.
    data_listeners : the same, also while it is off: of those that concern its rows.
    parts : makes the objects that a server keeps for it (`Services.get`).
    tasks, chores : of a worker; tasks get an event that is set when the worker stops.
    start : called once when a worker starts.
    """

    name: str
    switch: Switch | None = None
    listeners: Listeners = field(default_factory=dict[type, Sequence[Any]])
    data_listeners: Listeners = field(default_factory=dict[type, Sequence[Any]])
    parts: Callable[[Database], Sequence[object]] = _nothing
    tasks: Callable[[GymSettings, Database, FileStore, Event], Sequence[Task]] = _nothing
    chores: Callable[[GymSettings, Database], Sequence[Chore]] = _nothing
    start: Callable[[Database], object] = _nothing

    def routers(self) -> Sequence[APIRouter]:
        """Return its endpoints: `ROUTERS` of its module or package `http`."""
        found: Sequence[APIRouter] = import_module(f"walltopo_gym.{self.name}.http").ROUTERS
        return found

    def root_routers(self) -> Sequence[APIRouter]:
        """Return its endpoints outside of the API, for standards that fix an address:
        `ROOT_ROUTERS` of the same module, if it has any."""
        module = import_module(f"walltopo_gym.{self.name}.http")
        found: Sequence[APIRouter] = getattr(module, "ROOT_ROUTERS", ())
        return found
