"""Hypothesis strategies from type hints: any value that a declared document may have."""

from __future__ import annotations

import types
import typing
from typing import Annotated, Any, Literal, TypeVar

import msgspec
from hypothesis import strategies as st

T = TypeVar("T", bound=msgspec.Struct)

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
WHOLE = st.integers(-(2**63), 2**63 - 1)
JSON = st.recursive(
    st.none() | st.booleans() | WHOLE | NUMBERS | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(), inner, max_size=2),
    max_leaves=4,
)
PLAIN: dict[Any, st.SearchStrategy[Any]] = {
    int: WHOLE,
    float: NUMBERS,
    str: st.text(max_size=20),
    bool: st.booleans(),
    type(None): st.none(),
    Any: JSON,
}


def any_of(kind: type[T]) -> st.SearchStrategy[T]:
    """Any document of a class."""
    hints = typing.get_type_hints(kind, include_extras=True)
    values = {name: _any(hint) for name, hint in hints.items()}
    return st.builds(kind, **values)


def _any(hint: Any) -> st.SearchStrategy[Any]:
    origin, given = typing.get_origin(hint), typing.get_args(hint)
    if hint in PLAIN:
        return PLAIN[hint]
    if origin is Annotated:
        return _bounded(given[0], given[1])
    if origin is Literal:
        return st.sampled_from(given)
    if origin in (typing.Union, types.UnionType):
        return st.one_of(*map(_any, given))
    if origin is dict:
        return st.dictionaries(_any(given[0]), _any(given[1]), max_size=2)
    if origin is list:
        return st.lists(_any(given[0]), max_size=2)
    if origin is tuple and given[1:] == (...,):
        return st.lists(_any(given[0]), max_size=2).map(tuple)
    if origin is tuple:
        return st.tuples(*map(_any, given))
    return any_of(hint)


def _bounded(kind: Any, meta: msgspec.Meta) -> st.SearchStrategy[Any]:
    if kind is str and meta.extra == {"is": "date"}:
        return st.just("") | st.dates().map(str)
    if kind is str and meta.extra:
        return st.from_regex(r"[a-z]{1,8}(/[a-z]{1,8})?\.jpg", fullmatch=True)
    if kind is str:
        return st.text(max_size=min(20, meta.max_length or 20))
    if typing.get_origin(kind) is tuple:
        least = meta.min_length or 0
        return _any(kind).filter(lambda values: len(values) >= least)
    if kind is int:
        return st.integers(int(meta.ge or 0), int(meta.le or 2**63 - 1))
    low, high = (meta.ge if meta.gt is None else meta.gt), (meta.le if meta.lt is None else meta.lt)
    return st.floats(low, high, exclude_min=meta.gt is not None, exclude_max=meta.lt is not None)
