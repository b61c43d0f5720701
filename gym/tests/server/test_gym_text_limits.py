"""The own limit of a text in a request body is one that its type allows."""

from __future__ import annotations

from collections.abc import Iterator

from annotated_types import MaxLen
from gym.tests.worlds import Server
from pydantic import StringConstraints

from walltopo_gym.api.fields import Body


def bodies(kind: type[Body] = Body) -> Iterator[type[Body]]:
    for each in kind.__subclasses__():
        yield each
        yield from bodies(each)


def limits() -> Iterator[tuple[str, int, int]]:
    """Yield each text with a limit of its own: its name, that limit, and its type's."""
    for body in bodies():
        for name, field in body.model_fields.items():
            own = [one.max_length for one in field.metadata if isinstance(one, MaxLen)]
            of_type = [
                one.max_length
                for one in field.metadata
                if isinstance(one, StringConstraints) and one.max_length is not None
            ]
            if own and of_type:
                yield f"{body.__name__}.{name}", min(own), min(of_type)


def test_a_text_may_be_as_long_as_its_field_says(server: Server) -> None:
    found = list(limits())  # the server has imported every endpoint
    assert len(found) > 10
    assert [name for name, own, of_type in found if own > of_type] == []
