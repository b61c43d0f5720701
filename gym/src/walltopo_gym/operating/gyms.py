"""The limits that an operator sets for a gym: its storage quota and its features."""

from __future__ import annotations

from collections.abc import Sequence
from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.settings import Switch


def limit_gym(
    session: Session,
    gym: UUID,
    quota_mb: int | None,
    barred: Sequence[Switch],
    by: UUID | None,
) -> Gym:
    """Set the storage quota of a gym, and the features that are off for it whatever it chooses.

    Parameters
    ----------
    quota_mb : None: no limit. barred : the features; their data stays.
    by : the operator; None: by command.

    Raises
    ------
    NotFoundError : there is no such gym.
    """
    row = session.get(Gym, gym, with_for_update=True)
    if row is None:
        raise NotFoundError("not-there-gym")
    row.storage_quota_mb, row.features_barred = quota_mb, sorted(set(barred))
    features = " ".join(row.features_barred)
    log_change(
        session,
        "gym.limit",
        person=by,
        gym=row.id,
        subject=row.slug,
        quota_mb=quota_mb,
        features_barred=features,
    )
    return row
