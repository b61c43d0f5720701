"""Access rules of endpoints below `/gyms/{gym}`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any
from uuid import UUID

from fastapi import Depends, Path, Request
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import Rule, actor_in, check_scope
from walltopo_gym.accounts.actor import Actor, Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.services import ServicesOf, rule_session
from walltopo_gym.errors import ForbiddenError, NotFoundError, SignInNeededError
from walltopo_gym.events import Admission, collect_answers
from walltopo_gym.gyms.lookup import gym_by_slug
from walltopo_gym.gyms.members import check_not_banned, role_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.settings import Switch


@dataclass(frozen=True)
class Access:
    """A granted access to a gym."""

    gym: Gym
    role: Role
    actor: Actor

    def log_change(
        self,
        session: Session,
        action: str,
        subject: str = "",
        **details: str | int | bool | None,
    ) -> None:
        """Log a change in the gym by the actor; see `accounts.audit.log_change`."""
        person, gym = self.actor.known, self.gym.id
        log_change(session, action, person=person, gym=gym, subject=subject, **details)


def gym_rule(min_role: Role, scope: Scope | None) -> Any:
    """Return the dependency of an endpoint below `/gyms/{gym}`; it gives an `Access`.

    Parameters
    ----------
    min_role : `Role.GUEST`: everybody who may see the gym.
    """
    rule = Rule(min_role.value, scope)

    def check(
        gym: Annotated[str, Path(max_length=60)], request: Request, services: ServicesOf
    ) -> Access:
        with rule_session(request, services) as session:
            actor = actor_in(session, request)
            found, role = visible_gym(session, gym, actor, request)
            if not role.covers(min_role):
                if actor.person is None:
                    raise SignInNeededError("sign-in-needed", "sign-in-first")
                check_not_banned(session, found.id, actor.person)
                raise ForbiddenError("not-allowed-role", role=min_role)
        check_scope(actor, rule)
        return Access(found, role, actor)

    check.rule = rule  # type: ignore[attr-defined]
    return Depends(check)


GuestMay = Annotated[Access, gym_rule(Role.GUEST, Scope.READ)]
SetterMay = Annotated[Access, gym_rule(Role.SETTER, Scope.MANAGE)]
OwnerMay = Annotated[Access, gym_rule(Role.OWNER, Scope.MANAGE)]
PublisherMay = Annotated[Access, gym_rule(Role.SETTER, Scope.PUBLISH)]


def feature_rule(feature: Switch) -> Any:
    """Return the dependency of all endpoints of an optional feature: `visible_gym` answers 404 for
    gyms that have turned the feature off."""

    async def state(request: Request) -> None:
        request.state.feature = feature

    return Depends(state)


def visible_gym(session: Session, slug: str, actor: Actor, request: Request) -> tuple[Gym, Role]:
    """Return a gym and the person's role in it.

    Raises
    ------
    NotFoundError : it does not exist for this person, or has turned the endpoint's feature off.
    """
    found, role = _known_gym(session, slug, actor, request)
    if not found.has(getattr(request.state, "feature", None)):
        raise NotFoundError("not-there-feature")
    return found, role


def _known_gym(session: Session, slug: str, actor: Actor, request: Request) -> tuple[Gym, Role]:
    found = gym_by_slug(session, slug)
    # The same queries for a gym that does not exist, so that the duration reveals no private gym.
    gym = UUID(int=0) if found is None else found.id
    role = role_of(session, gym, actor.person)
    # Only where nobody is signed in: the link to a screen lets nobody join.
    is_screen = actor.person is None and True in collect_answers(
        session, Admission(gym, request.cookies)
    )
    if found is None or (found.visibility == "private" and role == Role.GUEST and not is_screen):
        raise NotFoundError("not-there-gym")
    return found, role
