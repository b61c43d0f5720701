"""Endpoints of gyms."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.gyms.http import gyms, members

ROUTERS: Final[tuple[APIRouter, ...]] = (
    gyms.router,
    gyms.grades_router,
    members.router,
    members.sign_up_router,
)
