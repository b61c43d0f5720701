"""All tables of the platform: importing this module completes `Base.metadata`."""

from __future__ import annotations

from sqlalchemy import MetaData

from walltopo_gym.accounts import models as _accounts
from walltopo_gym.climbing import models as _climbing
from walltopo_gym.database.base import Base
from walltopo_gym.features import FEATURES
from walltopo_gym.gyms import models as _gyms
from walltopo_gym.jobs import models as _jobs
from walltopo_gym.publishing import models as _publishing
from walltopo_gym.scans import models as _scans
from walltopo_gym.scans import own_network as _own_network
from walltopo_gym.storage import models as _storage
from walltopo_gym.walls import models as _walls

_SLICES = (
    _accounts,
    _gyms,
    _walls,
    _scans,
    _own_network,
    _publishing,
    _climbing,
    _jobs,
    _storage,
    FEATURES,
)
METADATA: MetaData = Base.metadata


def is_ours(name: str | None, kind: str, _: object) -> bool:
    """Return whether Alembic compares an object: SQLite's file has DBOS's tables, too."""
    return kind != "table" or name in METADATA.tables
