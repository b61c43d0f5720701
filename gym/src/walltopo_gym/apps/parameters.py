"""The parameters of OAuth's requests, in a query or a form."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qsl

_MAX_FIELDS: Final = 30


@dataclass(frozen=True)
class Parameters:
    """The parameters of a request; those without a value count as omitted (OAuth 2.1, 3.1).

    Parameters
    ----------
    once : those that come once. twice : the names of those that come more often and may not.
    resources : the targets of the tokens, of which there may be several (RFC 8707).
    """

    once: Mapping[str, str]
    twice: Sequence[str] = ()
    resources: Sequence[str] = ()


def read_parameters(text: str) -> Parameters:
    """Return the parameters of a query or a form.

    Raises
    ------
    ValueError : there are too many.
    """
    pairs = parse_qsl(text, max_num_fields=_MAX_FIELDS)
    counts = Counter(name for name, _ in pairs)
    return Parameters(
        once={name: value for name, value in pairs if counts[name] == 1},
        twice=[name for name, count in counts.items() if count > 1 and name != "resource"],
        resources=[value for name, value in pairs if name == "resource"],
    )
