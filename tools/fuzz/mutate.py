"""Mutations of a file: changed bytes, changed numbers in text, changed JSON values."""

from __future__ import annotations

import copy
import json
import random
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

# Wrong values that replace a field's own value.
WRONG: tuple[Any, ...] = (
    None,
    True,
    "",
    "x",
    "../../../x",
    "/etc/passwd",
    "\x1b[31m[/red]",
    "a" * 300,
    -1,
    0,
    1,
    0.5,
    -1.5,
    255,
    65_536,
    2**31 - 1,
    2**31,
    2**32,
    2**63,
    2**64,
    10**30,
    1e20,
    1e300,
    -1e300,
    [],
    [[]],
    [None],
    {},
    {"a": {}},
    [1, 2, 3],
    [0.0] * 7,
    ["x"],
)
_NUMBERS = (
    b"0",
    b"-1",
    b"1",
    b"7",
    b"255",
    b"65536",
    b"2147483647",
    b"2147483648",
    b"4294967295",
    b"9223372036854775808",
    b"1e300",
    b"1e999",
    b"-0.0",
    b"nan",
    b"inf",
    b"0x7f",
    b"9" * 60,
    b"9" * 5000,
    b"true",
    b"''",
    b"[]",
    b"{}",
)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_EDGES = (0, 1, 2**7, 2**8 - 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**64 - 1)


def places(value: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the key path of every value within a JSON value; () is the whole value."""
    yield way
    inner: Any = ()
    if isinstance(value, dict):
        inner = value.items()
    elif isinstance(value, list):
        inner = enumerate(value)
    for key, item in inner:
        yield from places(item, (*way, key))


def replaced(value: Any, way: tuple[Any, ...], other: Any) -> Any:
    """Return a copy of a JSON value with the value at one key path replaced."""
    if not way:
        return other
    result = copy.deepcopy(value)
    inner = result
    for key in way[:-1]:
        inner = inner[key]
    inner[way[-1]] = other
    return result


def damaged(
    files: Mapping[str, bytes], others: Sequence[Mapping[str, bytes]], seed: int
) -> dict[str, bytes]:
    """Return the files with damage in one of them; equal seeds give equal damage.

    Parameters
    ----------
    others : files of the same kind; damage may splice in parts of them.
    """
    rng = random.Random(seed)
    result = dict(files)
    name = rng.choice(sorted(files))
    if len(files) > 1 and rng.random() < 0.02:
        del result[name]
        return result
    data = result[name]
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        other = rng.choice(others).get(name, data)
        data = _once(data, other, rng, name)
    result[name] = data
    return result


def _once(data: bytes, other: bytes, rng: random.Random, name: str) -> bytes:
    if name.endswith(".glb") and rng.random() < 0.7:
        return _glb(data, rng)
    if name.endswith(".json") and rng.random() < 0.7:
        return _json(data, rng)
    if name.endswith((".toml", ".txt", ".obj", ".json", ".yaml")) and rng.random() < 0.5:
        return _number(data, rng)
    return _bytes(data, other, rng)


def _glb(data: bytes, rng: random.Random) -> bytes:
    """Damage the JSON chunk of a GLB and correct the lengths, so that the damage reaches the JSON
    parser.
    """
    if len(data) < 20:
        return data
    (length,) = struct.unpack_from("<I", data, 12)
    text = _json(data[20 : 20 + length], rng)
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    return head + text + rest


def _json(data: bytes, rng: random.Random) -> bytes:
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        return data
    way = rng.choice(list(places(value)))
    kind = rng.random()
    if kind < 0.1:  # text that json.dumps cannot produce
        text = json.dumps(replaced(value, way, "@@@"))
        odd = rng.choice(
            ("NaN", "1e999", "9" * 5000, "[" * 100_000, '"\\ud800"', "[" * 200 + "]" * 200)
        )
        return text.replace('"@@@"', odd).encode()
    if kind < 0.25 and way:
        return json.dumps(_without(value, way)).encode()
    if kind < 0.35 and way:
        return json.dumps(_twice(value, way)).encode()
    return json.dumps(replaced(value, way, rng.choice(WRONG))).encode()


def _parent(value: Any, way: tuple[Any, ...]) -> tuple[Any, Any]:
    result = copy.deepcopy(value)
    inner = result
    for key in way[:-1]:
        inner = inner[key]
    return result, inner


def _without(value: Any, way: tuple[Any, ...]) -> Any:
    result, inner = _parent(value, way)
    del inner[way[-1]]
    return result


def _twice(value: Any, way: tuple[Any, ...]) -> Any:
    result, inner = _parent(value, way)
    if isinstance(inner, list):
        inner.insert(way[-1], copy.deepcopy(inner[way[-1]]))
    else:
        inner[f"{way[-1]} "] = inner[way[-1]]
    return result


def _number(data: bytes, rng: random.Random) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return data
    spot = rng.choice(found)
    return data[: spot.start()] + rng.choice(_NUMBERS) + data[spot.end() :]


def _bytes(data: bytes, other: bytes, rng: random.Random) -> bytes:
    if not data:
        return other[: rng.randrange(64)]
    at = rng.randrange(len(data))
    end = min(len(data), at + rng.choice((1, 2, 4, 8, 16, rng.randrange(1, len(data) + 1))))
    kind = rng.randrange(7)
    if kind == 0:
        return data[:at]
    if kind == 1:
        return data[:at] + data[end:]
    if kind == 2:
        return data[:end] + data[at:end] * rng.choice((1, 1, 50)) + data[end:]
    if kind == 3:
        return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]
    if kind == 4:
        width = rng.choice((1, 2, 4, 8))
        number = rng.choice(_EDGES) % 256**width
        return (
            data[:at] + number.to_bytes(width, rng.choice(("little", "big"))) + data[at + width :]
        )
    if kind == 5:
        start = rng.randrange(len(other) or 1)
        return data[:at] + other[start : start + (end - at)] + data[end:]
    return data[:at] + rng.randbytes(end - at) + data[end:]
