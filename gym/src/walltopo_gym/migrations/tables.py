"""All tables of the platform: importing this module completes `Base.metadata`."""

from __future__ import annotations

from sqlalchemy import MetaData

from walltopo_gym.accounts import models as _accounts
from walltopo_gym.climbing import models as _climbing
from walltopo_gym.competitions import models as _competitions
from walltopo_gym.database.base import Base
from walltopo_gym.grading import models as _grading
from walltopo_gym.gyms import models as _gyms
from walltopo_gym.hall import models as _hall
from walltopo_gym.hold_reports import models as _hold_reports
from walltopo_gym.insights import models as _insights
from walltopo_gym.problems import models as _problems
from walltopo_gym.publishing import models as _publishing
from walltopo_gym.reset_plans import models as _reset_plans
from walltopo_gym.scans import models as _scans
from walltopo_gym.scans import own_network as _own_network
from walltopo_gym.walls import models as _walls
from walltopo_gym.webhooks import models as _webhooks

_SLICES = (_accounts, _gyms, _walls, _scans, _own_network, _publishing, _competitions,
           _climbing, _webhooks, _insights, _grading, _problems, _hold_reports, _reset_plans,
           _hall)  # fmt: skip
METADATA: MetaData = Base.metadata


def is_ours(name: str | None, kind: str, _: object) -> bool:
    """Return whether Alembic compares an object: SQLite's file has DBOS's tables, too."""
    return kind != "table" or name in METADATA.tables
