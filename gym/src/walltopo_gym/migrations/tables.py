"""All tables of the platform: importing this module makes `Base.metadata` whole."""

from __future__ import annotations

from sqlalchemy import MetaData

from walltopo_gym.accounts import models as _accounts
from walltopo_gym.attempts import models as _attempts
from walltopo_gym.climbing import counted_models as _counted
from walltopo_gym.climbing import models as _climbing
from walltopo_gym.competitions import models as _competitions
from walltopo_gym.database.base import Base
from walltopo_gym.editing import models as _editing
from walltopo_gym.grading import models as _grading
from walltopo_gym.gyms import models as _gyms
from walltopo_gym.hall import models as _hall
from walltopo_gym.insights import models as _insights
from walltopo_gym.publishing import models as _publishing
from walltopo_gym.scans import models as _scans
from walltopo_gym.uploads import models as _uploads
from walltopo_gym.webhooks import models as _webhooks

_ROOMS = (_accounts, _gyms, _scans, _uploads, _publishing, _editing, _competitions, _climbing,
          _counted, _webhooks, _insights, _grading, _hall, _attempts)  # fmt: skip
METADATA: MetaData = Base.metadata
