"""What people call a route."""

from __future__ import annotations

from walltopo.scans.routes import Route

__all__ = ["route_name"]


def route_name(route: Route) -> str:
    """Its setter's name, else as the page says, such as "Red 3"."""
    return route.name or f"{(route.colour or 'route').capitalize()} {route.id}"
