"""Endpoints of the hall."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.hall.http import paper, screen

ROUTERS: Final[tuple[APIRouter, ...]] = (
    screen.router,
    paper.router,
)
