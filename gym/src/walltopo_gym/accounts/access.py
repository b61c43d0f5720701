"""Access rules of endpoints. Each one declares one rule, and the application does not start with an
endpoint without one (`rules_of`); the rule stands in the OpenAPI document as `x-walltopo-rule`.

404 for people who may not see a gym, 403 for people who see it and lack the role, 401 where
signing in would help.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import timedelta
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import NOBODY, Actor, Scope, by_cookie, by_token
from walltopo_gym.api.services import ServicesOf, endpoint_session, rule_session, token_of
from walltopo_gym.clock import now
from walltopo_gym.errors import ForbiddenError, SignInNeededError

# `__Host-`: over HTTPS only, of this host only, for all of it (RFC 6265bis, 4.1.3.2).
COOKIE: Final = "__Host-walltopo"
# The app says whose something is that it sends days later, perhaps while others sign in.
FOR: Final = "x-walltopo-person"


@dataclass(frozen=True)
class Rule:
    """An access rule.

    Parameters
    ----------
    who : "anyone", "signed-in", "operator", or the minimum role in the gym ("guest": may see it).
    scope : the scope that a token needs; None: tokens are refused, only browsers are accepted.
    """

    who: str
    scope: Scope | None


def actor_in(session: Session, request: Request) -> Actor:
    """Return the actor of a request. A token takes precedence over a cookie.

    Raises
    ------
    SignInNeededError : the request was queued in a browser for a person (`FOR`) who has signed out.
    """
    token, cookie = token_of(request.headers), request.cookies.get(COOKIE)
    if token is None and not cookie:
        return NOBODY
    actor = by_cookie(session, cookie or "") if token is None else by_token(session, token)
    if FOR in request.headers and request.headers[FOR] != str(actor.person):
        raise SignInNeededError("waited-for-another", "sign-in-first")
    return actor


def check_scope(actor: Actor, rule: Rule) -> None:
    if actor.scopes is None:
        return
    if rule.scope is None:
        raise ForbiddenError("token-never", "sign-in-in-browser")
    if rule.scope not in actor.scopes:
        raise ForbiddenError("token-lacks-scope", "token-make-with-scope", scope=rule.scope)


@dataclass(frozen=True)
class _Proof:
    """A limit of the time since the owner of a browser last proved who they are.

    Parameters
    ----------
    lasts : how long a proof is good for; error : key of the error after that.
    """

    lasts: timedelta
    error: str


# Long enough for a page of settings, short for somebody who found a phone.
_OF_OWNER: Final = _Proof(timedelta(minutes=10), "confirm-first")
_OF_OPERATOR: Final = _Proof(timedelta(minutes=15), "confirm-operator")


def _person_rule(rule: Rule, proof: _Proof | None = None) -> Callable[..., Actor]:
    def check(request: Request, services: ServicesOf) -> Actor:
        with rule_session(request, services) as session:
            actor = actor_in(session, request)
        if rule.who != "anyone":
            _ = actor.known
        if rule.who == "operator" and not actor.operator:
            raise ForbiddenError("not-allowed-operator")
        check_scope(actor, rule)
        if proof is not None:
            _check_confirmed(actor, proof)
        return actor

    check.rule = rule  # type: ignore[attr-defined]
    return check


AnyoneMay = Annotated[Actor, Depends(_person_rule(Rule("anyone", Scope.READ)))]
# For visitors who sign in, sign up or follow a link; a program that acts for a person does not.
BrowserMay = Annotated[Actor, Depends(_person_rule(Rule("anyone", None)))]
SignedInMay = Annotated[Actor, Depends(_person_rule(Rule("signed-in", None)))]
# For what outlasts a sign-in: ways to sign in, and programs that act for a person.
ConfirmedMay = Annotated[Actor, Depends(_person_rule(Rule("signed-in", None), _OF_OWNER))]
# For the whole server, and never by a program.
OperatorMay = Annotated[Actor, Depends(_person_rule(Rule("operator", None), _OF_OPERATOR))]


def _check_confirmed(actor: Actor, proof: _Proof) -> None:
    """Refuse a browser whose owner has not proved lately who they are.

    Raises
    ------
    ForbiddenError : says how to do it.
    """
    if actor.confirmed_at is None or actor.confirmed_at < now() - proof.lasts:
        raise ForbiddenError(proof.error, "confirm-how")


def _dependency_calls(dependant: Dependant) -> Iterator[Callable[..., Any]]:
    """Yield the dependencies of an endpoint in the order in which they are called."""
    for inner in dependant.dependencies:
        yield from _dependency_calls(inner)
    if dependant.call is not None:
        yield dependant.call


def declare_rules(router: APIRouter) -> None:
    """Write each endpoint's access rule into the OpenAPI document.

    Raises
    ------
    RuntimeError : an endpoint has no rule, or several, or begins its transaction after the rule.
    """
    for route in router.routes:
        if not isinstance(route, APIRoute):
            raise RuntimeError(f"{route} is not an endpoint that can have a rule")
        calls = list(_dependency_calls(route.dependant))
        rules = [rule for call in calls if isinstance(rule := getattr(call, "rule", None), Rule)]
        if len(rules) != 1:
            raise RuntimeError(f"{route.methods} {route.path} has {len(rules)} rules, expected one")
        order = [call for call in calls if call is endpoint_session or hasattr(call, "rule")]
        if endpoint_session in order[1:]:
            raise RuntimeError(f"{route.methods} {route.path}: `session: Db` comes before the rule")
        extra = dict(route.openapi_extra or {})
        scope = rules[0].scope
        extra["x-walltopo-rule"] = {"who": rules[0].who, "scope": scope and scope.value}
        route.openapi_extra = extra
