"""Who may use an endpoint. Each one declares one rule, and the application does not start with an
endpoint that has none (`rules_of`); the rule stands in the OpenAPI document as `x-walltopo-rule`.

To whoever may not see a gym it is not there (404). Who sees it and may not do a thing is told so
(403). Where signing in would help, 401.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Path, Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import NOBODY, Actor, Scope, by_cookie, by_token
from walltopo_gym.api.services import ServicesOf
from walltopo_gym.errors import ForbiddenError, NotFoundError, SignInNeededError
from walltopo_gym.gyms.members import check_not_banned, role_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.hall.screen import has_key

# `__Host-`: over HTTPS only, of this host only, for all of it (RFC 6265bis, 4.1.3.2).
COOKIE: Final = "__Host-walltopo"
# Of a screen in the hall: it is a guest of one private gym.
KIOSK: Final = "__Host-walltopo-kiosk"
# The app says whose something is that it sends days later, perhaps while others sign in.
FOR: Final = "x-walltopo-person"


@dataclass(frozen=True)
class Rule:
    """Who may.

    Parameters
    ----------
    who : "anyone", "signed-in", "operator", or the least role in the gym ("guest": who sees it).
    scope : what a token needs; None: no token will do, only a browser.
    """

    who: str
    scope: Scope | None


@dataclass(frozen=True)
class Access:
    """Somebody's way into a gym, granted."""

    gym: Gym
    role: Role
    actor: Actor


def _actor_in(session: Session, request: Request) -> Actor:
    """Who asks. A token that is given counts, whatever cookie comes with it.

    Raises
    ------
    SignInNeededError : what waited in a browser is somebody's (`FOR`) who is signed in no more.
    """
    kind, _, secret = request.headers.get("authorization", "").partition(" ")
    cookie = request.cookies.get(COOKIE)
    is_token = kind.lower() == "bearer"
    if not is_token and not cookie:
        return NOBODY
    actor = by_token(session, secret.strip()) if is_token else by_cookie(session, cookie or "")
    if FOR in request.headers and request.headers[FOR] != str(actor.person):
        raise SignInNeededError("this is of somebody who is not signed in here", "Sign in first.")
    return actor


def _check_scope(actor: Actor, rule: Rule) -> None:
    if actor.scopes is None:
        return
    if rule.scope is None:
        raise ForbiddenError("no token may do this", "Sign in in a browser.")
    if rule.scope not in actor.scopes:
        raise ForbiddenError(f"this token lacks the scope {rule.scope!r}", "Make one that has it.")


def _person_rule(rule: Rule) -> Callable[..., Actor]:
    def check(request: Request, services: ServicesOf) -> Actor:
        # Read apart from the endpoint's own transaction, which may begin later, or be several.
        with services.database.reading() as session:
            actor = _actor_in(session, request)
        if rule.who != "anyone":
            _ = actor.known
        if rule.who == "operator" and not actor.operator:
            raise ForbiddenError("only an operator of this server may do this")
        _check_scope(actor, rule)
        return actor

    check.rule = rule  # type: ignore[attr-defined]
    return check


AnyoneMay = Annotated[Actor, Depends(_person_rule(Rule("anyone", Scope.READ)))]
SignedInMay = Annotated[Actor, Depends(_person_rule(Rule("signed-in", None)))]
OperatorsMay = Annotated[Actor, Depends(_person_rule(Rule("operator", Scope.MANAGE)))]


def gym_rule(least: Role, scope: Scope | None) -> Any:
    """The dependency of an endpoint below `/gyms/{gym}`; gives an `Access`.

    Parameters
    ----------
    least : `Role.GUEST`: whoever sees the gym.
    """
    rule = Rule(least.value, scope)

    def check(
        gym: Annotated[str, Path(max_length=60)], request: Request, services: ServicesOf
    ) -> Access:
        with services.database.reading() as session:
            actor = _actor_in(session, request)
            found, role = visible_gym(session, gym, actor, request)
        if not role.covers(least):
            if actor.person is None:
                raise SignInNeededError("nobody is signed in", "Sign in first.")
            with services.database.reading() as session:
                check_not_banned(session, found.id, actor.person)
            raise ForbiddenError(f"only a {least} of this gym may do this")
        _check_scope(actor, rule)
        return Access(found, role, actor)

    check.rule = rule  # type: ignore[attr-defined]
    return Depends(check)


GuestMay = Annotated[Access, gym_rule(Role.GUEST, Scope.READ)]
SetterMay = Annotated[Access, gym_rule(Role.SETTER, Scope.MANAGE)]
OwnerMay = Annotated[Access, gym_rule(Role.OWNER, Scope.MANAGE)]


def visible_gym(session: Session, slug: str, actor: Actor, request: Request) -> tuple[Gym, Role]:
    """A gym, and what the asker is in it.

    Raises
    ------
    NotFoundError : there is none that they may know of.
    """
    found = session.scalar(select(Gym).where(Gym.slug == slug))
    if found is not None:
        role = role_of(session, found.id, actor.person)
        if found.visibility != "private" or role != Role.GUEST:
            return found, role
        # Only where nobody is signed in: the link to a screen lets nobody join.
        secret = request.cookies.get(KIOSK, "") if actor.person is None else ""
        if secret and has_key(session, found.id, secret):
            return found, role
    raise NotFoundError("no such gym")


def _rules(dependant: Dependant) -> Iterator[Rule]:
    rule = getattr(dependant.call, "rule", None)
    if isinstance(rule, Rule):
        yield rule
    for inner in dependant.dependencies:
        yield from _rules(inner)


def declare_rules(router: APIRouter) -> None:
    """Let the document say of each endpoint who may use it.

    Raises
    ------
    RuntimeError : an endpoint has no rule, or more than one.
    """
    for route in router.routes:
        if not isinstance(route, APIRoute):
            raise RuntimeError(f"{route} is no endpoint that could have a rule")
        rules = list(_rules(route.dependant))
        if len(rules) != 1:
            raise RuntimeError(f"{route.methods} {route.path} has {len(rules)} rules, expected one")
        extra = dict(route.openapi_extra or {})
        scope = rules[0].scope
        extra["x-walltopo-rule"] = {"who": rules[0].who, "scope": scope and scope.value}
        route.openapi_extra = extra
