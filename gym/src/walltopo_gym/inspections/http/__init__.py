"""Endpoints of inspections."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.inspections.http import entries, inspections, plans, records

# The plan's addresses come first: "plan" and "due" are no ids of inspections.
ROUTERS: Final[tuple[APIRouter, ...]] = (
    plans.router,
    inspections.router,
    entries.router,
    records.router,
)
