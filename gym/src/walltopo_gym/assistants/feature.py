"""The MCP server, as a feature of the platform."""

from __future__ import annotations

from walltopo_gym.feature import Feature

FEATURE = Feature("assistants")
