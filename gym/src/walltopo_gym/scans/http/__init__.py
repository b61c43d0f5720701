"""Endpoints of scans and uploads."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.scans.http import plates, scans, uploads

ROUTERS: Final[tuple[APIRouter, ...]] = (
    scans.router,
    uploads.router,
    plates.router,
)
