"""Entries about routes: which holds they have, what is said of them, roles of holds in them."""

from __future__ import annotations

from dataclasses import replace

import msgspec

from walltopo.edit.board import Board, RouteFacts
from walltopo.edit.notes import MissingError
from walltopo.scans.edits import (
    Assign,
    Leave,
    Merge,
    Ref,
    RoleName,
    SetProblem,
    SetRole,
    SetRoute,
    Share,
    Split,
)

__all__ = ["assign", "leave", "merge", "set_problem", "set_role", "set_route", "share", "split"]


def merge(board: Board, edit: Merge) -> None:
    """Routes become one, under the first one's id, with what was said of that one."""
    routes = list(dict.fromkeys(board.route(ref) for ref in edit.routes))
    if len(routes) < 2:
        raise MissingError("routes_one", *(ref.id for ref in edit.routes))
    first, *others = routes
    for hold, route in board.route_of.items():
        if route in routes:
            board.route_of[hold] = first
            board.decided.add(hold)
    for route in others:
        board.facts.pop(route, None)
        for hold in board.shared.pop(route, []):
            board.share(hold, first)
    for (route, hold), role in list(board.roles.items()):
        if route in others:
            del board.roles[route, hold]
            board.roles.setdefault((first, hold), role)


def split(board: Board, edit: Split) -> None:
    """Holds leave their route, with their roles, and make one of their own."""
    holds = list(dict.fromkeys(_climbed(board, ref) for ref in edit.holds))
    left = {board.route_of[hold] for hold in holds if hold in board.route_of}
    board.decided.update(hold for hold, route in board.route_of.items() if route in left)
    new = board.new_route(edit.new)
    for hold in holds:
        role = board.roles.get((board.route_of.get(hold, 0), hold))
        board.place(hold, new)
        if role is not None:
            board.roles[new, hold] = role
        board.decided.add(hold)
    _forget_empty(board, left)


def assign(board: Board, edit: Assign) -> None:
    """A hold belongs to a route, or to none."""
    hold = _climbed(board, edit.hold)
    left = {board.route_of.get(hold, 0)}
    if edit.route.id == 0:
        left = {*board.routes_of(hold)}
        for route in left:
            board.leave(hold, route)
    else:
        board.place(hold, board.route(edit.route))
        # Whoever puts a downclimb hold into a route says that it is none.
        board.holds[hold] = msgspec.structs.replace(board.holds[hold], role="hold")
    board.decided.add(hold)
    _forget_empty(board, left)


def set_problem(board: Board, edit: SetProblem) -> None:
    """A new route on holds that stay where they are."""
    hands = list(dict.fromkeys(_climbed(board, ref) for ref in edit.hands))
    said: tuple[tuple[RoleName, tuple[Ref, ...]], ...] = (
        ("foot", edit.feet),
        ("start", edit.start),
        ("top", edit.top),
    )
    roles: dict[int, RoleName] = dict.fromkeys(hands, "hand")
    for role, refs in said:
        roles |= dict.fromkeys((_climbed(board, ref) for ref in refs), role)
    number = board.new_route(edit.new)
    for hold, role in roles.items():
        board.share(hold, number)
        board.roles[number, hold] = role
    board.facts[number] = RouteFacts(proposed=edit.proposed)


def share(board: Board, edit: Share) -> None:
    """A hold is of a route beside its own."""
    board.share(_climbed(board, edit.hold), board.route(edit.route))


def leave(board: Board, edit: Leave) -> None:
    """A hold is not of a route any more."""
    hold, route = board.hold(edit.hold).id, board.route(edit.route)
    if route not in board.routes_of(hold):
        raise MissingError("other_route", edit.hold.id, edit.route.id)
    board.leave(hold, route)
    board.decided.add(hold)
    _forget_empty(board, {route})


def set_route(board: Board, edit: SetRoute) -> None:
    """What is said of a route; empty text takes it back."""
    route = board.route(edit.route)
    said = {
        name: getattr(edit, name)
        for name in RouteFacts.__dataclass_fields__
        if getattr(edit, name) is not None
    }
    board.facts[route] = replace(board.facts.get(route, RouteFacts()), **said)


def set_role(board: Board, edit: SetRole) -> None:
    """What a hold is in its route."""
    hold, route = board.hold(edit.hold), board.route(edit.route)
    if hold.role != "volume" and route not in board.routes_of(hold.id):
        raise MissingError("other_route", edit.hold.id, edit.route.id)
    board.roles[route, hold.id] = edit.role


def _climbed(board: Board, ref: Ref) -> int:
    """The id of a hold that may be of one route."""
    hold = board.hold(ref)
    if hold.role == "volume":
        raise MissingError("volume", ref.id)
    return hold.id


def _forget_empty(board: Board, routes: set[int]) -> None:
    """What was said of routes that have no hold any more."""
    for route in routes - board.routes:
        board.facts.pop(route, None)
        for key in [key for key in board.roles if key[0] == route]:
            del board.roles[key]
