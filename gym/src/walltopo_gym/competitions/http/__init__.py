"""Endpoints of competitions."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.competitions.http import competitions, entries, judge_links, scoring

ROUTERS: Final[tuple[APIRouter, ...]] = (
    scoring.router,
    judge_links.router,
    competitions.router,
    entries.router,
)
