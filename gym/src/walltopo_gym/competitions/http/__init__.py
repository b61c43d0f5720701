"""Endpoints of competitions."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.competitions.http import competitions, entries, scoring

ROUTERS: Final[tuple[APIRouter, ...]] = (
    scoring.router,
    competitions.router,
    entries.router,
)
