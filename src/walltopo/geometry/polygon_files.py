"""Read OBJ and PLY files of polygons, with triangles in the order of the file's faces.

trimesh groups the faces of an OBJ by material and puts the triangles of quads last, so that a label
per face would belong to another face of the file. Sources of the formats: the OBJ specification
(Wavefront, appendix B1) and Turk's "The PLY Polygon File Format" (1994).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError

Ints = NDArray[np.int64]
GUESSED = "guessed"  # number of a PLY's face, not 0 if it spans a hole


@dataclass(frozen=True, eq=False)
class PolygonFile:
    """The content of a file of polygons.

    Parameters
    ----------
    vertices : (V, 3) float.
    colours : (V, 3) uint8 sRGB, or None.
    counts : (P,) corners of each polygon, at least 3.
    corners : (sum of counts,) int, vertex of each corner, polygon after polygon.
    guessed : (P,) bool, whether a polygon spans a hole (see `Mesh`), or None if unknown.
    """

    vertices: NDArray[np.float64]
    colours: NDArray[np.uint8] | None
    counts: Ints
    corners: NDArray[np.integer]
    guessed: NDArray[np.bool_] | None = None

    def triangles(self) -> tuple[NDArray[np.integer], Ints | None]:
        """Return (F, 3) triangles, a fan for each polygon in place, and (F,) their polygons, None
        if all are triangles."""
        if (self.counts == 3).all():
            return self.corners.reshape(-1, 3), None
        fans = self.counts - 2
        polygon = np.repeat(np.arange(len(fans)), fans)
        first = np.repeat(np.cumsum(self.counts) - self.counts, fans)
        step = np.arange(len(polygon)) - np.repeat(np.cumsum(fans) - fans, fans)
        at = np.stack([first, first + step + 1, first + step + 2], axis=1)
        return self.corners[at], polygon


def read_obj(content: bytes) -> PolygonFile:
    """Return the polygons of an OBJ file; groups, materials, lines and points are left out.

    Raises
    ------
    InputError : a vertex or a face is invalid; the message has the number of its line.
    """
    lines = content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines()
    vertex_lines = [k for k, line in enumerate(lines) if line.lstrip()[:2] in (b"v ", b"v\t")]
    face_lines = [k for k, line in enumerate(lines) if line.lstrip()[:2] in (b"f ", b"f\t")]
    rows = [lines[k].split()[1:] for k in vertex_lines]
    coordinates = _parse_numbers([row[:3] for row in rows], vertex_lines, "vertex", 3)
    colours = None
    if rows and min(map(len, rows)) >= 6:  # x y z r g b, each colour from 0 to 1
        shares = _parse_numbers([row[3:6] for row in rows], vertex_lines, "vertex", 3)
        colours = _colours_of(shares)
    # A corner is vertex, vertex/texture, vertex//normal or vertex/texture/normal.
    corners = [re.sub(rb"/\S*", b"", lines[k]).split()[1:] for k in face_lines]
    counts = np.array([len(row) for row in corners], dtype=np.int64)
    if len(counts) and counts.min() < 3:
        raise InputError(
            f"line {face_lines[int(counts.argmin())] + 1}: a face of {counts.min()} corners"
        )
    try:
        flat = np.array([word for row in corners for word in row], dtype=np.int64)
    except (OverflowError, ValueError) as error:
        raise InputError(f"a face has a corner that is not a number ({error})") from error
    # Negative numbers count back from the last vertex above the face.
    above = np.searchsorted(vertex_lines, face_lines)
    flat = np.where(flat < 0, flat + np.repeat(above, counts), flat - 1)
    return _check_corners(PolygonFile(coordinates, colours, counts, flat), face_lines)


def _parse_numbers(
    rows: list[list[bytes]], lines: list[int], what: str, size: int
) -> NDArray[np.float64]:
    """Return rows of words as (n, size) numbers."""
    try:
        return np.array(rows, dtype=np.float64).reshape(len(rows), size)
    except ValueError:
        for row, line in zip(rows, lines, strict=True):
            try:
                if len([float(word) for word in row]) == size:
                    continue
            except ValueError:
                pass
            raise InputError(f"line {line + 1}: not a {what}") from None
        raise


def _check_corners(found: PolygonFile, lines: list[int] | None = None) -> PolygonFile:
    """Return the polygons; raise InputError if a corner is no vertex."""
    outside = (found.corners < 0) | (found.corners >= len(found.vertices))
    if outside.any():
        polygon = int(np.repeat(np.arange(len(found.counts)), found.counts)[outside.argmax()])
        where = f"face {polygon}" if lines is None else f"line {lines[polygon] + 1}"
        raise InputError(f"{where}: a corner that is not one of the {len(found.vertices)} vertices")
    return found


_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}


@dataclass(frozen=True)
class _Property:
    """A property of a PLY element; `count` is the type of a list's length, None for a number."""

    name: str
    kind: str
    count: str | None = None


@dataclass(frozen=True)
class _Element:
    name: str
    size: int
    properties: tuple[_Property, ...]

    @property
    def is_plain(self) -> bool:
        """Whether there is no list among the properties."""
        return all(prop.count is None for prop in self.properties)

    def is_list(self, name: str) -> bool:
        """Return whether there is a list of that name."""
        return any(prop.name == name and prop.count is not None for prop in self.properties)


# The corners of each face, their vertices, and whether each face is guessed; see `PolygonFile`.
_Faces = tuple[Ints, NDArray[np.integer], NDArray[np.bool_] | None]


def read_ply(content: bytes) -> PolygonFile:
    """Return the polygons of a PLY file.

    Raises
    ------
    InputError : the file is damaged, or a face has fewer than 3 corners or an unknown vertex.
    """
    head, mark, body = content.partition(b"end_header")
    if not mark:
        raise InputError("damaged: its header has no end")
    body = body[1:] if body[:1] == b"\n" else body.partition(b"\n")[2]
    kind, elements = _read_header(head.decode("ascii", "replace"))
    reader = _Ascii(body) if kind == "ascii" else _Binary(body, "<" if "little" in kind else ">")
    vertices: NDArray[np.float64] = np.zeros((0, 3))
    colours: NDArray[np.uint8] | None = None
    faces: _Faces | None = None
    for element in elements:
        if element.name == "vertex":
            vertices, colours = _read_vertices(reader.table(element))
        elif element.name == "face" and element.size:
            faces = _read_faces(reader, element)
        else:
            reader.skip(element)
        if len(vertices) and faces is not None:
            break
    if faces is None:
        faces = np.zeros(0, np.int64), np.zeros(0, np.int64), None
    counts, corners, guessed = faces
    return _check_corners(PolygonFile(vertices, colours, counts, corners, guessed))


def _read_header(text: str) -> tuple[str, list[_Element]]:
    """Return the kind of a PLY file and its elements, by its header."""
    kind, elements = "", []
    for line in text.splitlines():
        match line.split():
            case ["format", name, *_]:
                kind = name
            case ["element", name, size]:
                elements.append(_Element(name, int(size), ()))
            case ["property", "list", count, item, name] if elements:
                elements[-1] = _extended(elements[-1], _Property(name, item, count))
            case ["property", item, name] if elements:
                elements[-1] = _extended(elements[-1], _Property(name, item))
    for element in elements:
        names = [prop.name for prop in element.properties]
        if len(set(names)) < len(names):
            raise InputError(f"damaged: a property of {element.name} is declared twice")
    types = {item for e in elements for p in e.properties for item in (p.kind, p.count) if item}
    if kind not in ("ascii", "binary_little_endian", "binary_big_endian") or types - _TYPES.keys():
        raise InputError(f"not a PLY file that can be read: format {kind!r}, types {sorted(types)}")
    return kind, elements


def _extended(element: _Element, prop: _Property) -> _Element:
    return _Element(element.name, element.size, (*element.properties, prop))


def _read_vertices(
    table: dict[str, NDArray[Any]],
) -> tuple[NDArray[np.float64], NDArray[np.uint8] | None]:
    """Return the places and colours of a table of vertices."""
    if not {"x", "y", "z"} <= table.keys():
        raise InputError("its vertices have no x, y, z")
    places = np.stack([table[axis].astype(np.float64) for axis in "xyz"], axis=1)
    names = ("red", "green", "blue")
    if not all(name in table for name in names):
        return places, None
    return places, _colours_of(np.stack([table[name] for name in names], axis=1))


def _colours_of(values: NDArray[Any]) -> NDArray[np.uint8] | None:
    """Return (n, 3) colours, from 0 to 1 as floats and from 0 to 255 as integers, as bytes.

    Return None if an integer is outside this range.
    """
    if values.dtype.kind == "f":
        shares = np.nan_to_num(values.astype(np.float64), posinf=0.0, neginf=0.0)
        return np.clip(np.rint(255 * shares), 0, 255).astype(np.uint8)
    in_range = values.min(initial=0) >= 0 and values.max(initial=0) <= 255
    return values.astype(np.uint8) if in_range else None


def _read_faces(reader: _Binary | _Ascii, element: _Element) -> _Faces:
    """Read the faces of a PLY file."""
    vertices = next(filter(element.is_list, ("vertex_indices", "vertex_index")), "")
    if not vertices:
        raise InputError("its faces have no list of vertices")
    if element.is_list(GUESSED):
        raise InputError(f"face property `{GUESSED}`: expected one number per face")
    faces = reader.triangles(element, vertices) or reader.lists(element, vertices)
    if faces[0].min() < 3:
        raise InputError(f"face {int(faces[0].argmin())} has {faces[0].min()} corners")
    return faces


class _Binary:
    """Steps through the elements of a binary PLY file."""

    def __init__(self, body: bytes, order: str) -> None:
        self.body, self.order, self.at = body, order, 0

    def _type(self, name: str) -> np.dtype[Any]:
        return np.dtype(self.order + _TYPES[name])

    def _take(self, kind: np.dtype[Any], count: int) -> NDArray[Any]:
        end = self.at + kind.itemsize * count
        if end > len(self.body):
            raise InputError("damaged: it ends before its last entry")
        values = np.frombuffer(self.body, kind, count, self.at)
        self.at = end
        return values

    def table(self, element: _Element) -> dict[str, NDArray[Any]]:
        """Return the columns of an element without lists."""
        if not element.is_plain:
            raise InputError(f"its element {element.name} has lists")
        fields = [(prop.name, self._type(prop.kind)) for prop in element.properties]
        values = self._take(np.dtype(fields), element.size)
        return {name: values[name].astype(kind.newbyteorder("=")) for name, kind in fields}

    def triangles(self, element: _Element, vertices: str) -> _Faces | None:
        """Return the faces if each of their lists has three entries, else None."""
        fields: list[Any] = []
        for prop in element.properties:
            if prop.count is not None:
                fields.append((f"number of {prop.name}", self._type(prop.count)))
            shape = () if prop.count is None else (3,)
            fields.append((prop.name, self._type(prop.kind), shape))
        kind = np.dtype(fields)
        if self.at + kind.itemsize * element.size > len(self.body):
            return None
        rows = np.frombuffer(self.body, kind, element.size, self.at)
        lists = [prop.name for prop in element.properties if prop.count is not None]
        if not all(bool((rows[f"number of {name}"] == 3).all()) for name in lists):
            return None
        self.at += rows.nbytes
        corners = rows[vertices].astype(rows[vertices].dtype.newbyteorder("=")).reshape(-1)
        guessed = rows[GUESSED] != 0 if GUESSED in (kind.names or ()) else None
        return np.full(len(rows), 3), corners, guessed

    def lists(self, element: _Element, vertices: str) -> _Faces:
        """Return the faces, read one by one."""
        counts: list[int] = []
        corners: list[NDArray[Any]] = []
        guessed: list[bool] = []
        for _ in range(element.size):
            for prop in element.properties:
                if prop.count is None:
                    value = self._take(self._type(prop.kind), 1)[0]
                    if prop.name == GUESSED:
                        guessed.append(value != 0)
                    continue
                count = int(self._take(self._type(prop.count), 1)[0])
                row = self._take(self._type(prop.kind), count)
                if prop.name == vertices:
                    counts.append(count)
                    corners.append(row)
        flat = np.concatenate([np.zeros(0, np.int64), *corners]).astype(np.int64)
        return np.array(counts, dtype=np.int64), flat, np.array(guessed) if guessed else None

    def skip(self, element: _Element) -> None:
        """Step over an element."""
        self.table(element) if element.is_plain else self.lists(element, "")


class _Ascii:
    """Steps through the elements of a text PLY file: a line for each entry."""

    def __init__(self, body: bytes) -> None:
        self.lines = [line.split() for line in body.splitlines() if line.strip()]
        self.at = 0

    def _take(self, count: int) -> list[list[bytes]]:
        rows = self.lines[self.at : self.at + count]
        if len(rows) < count:
            raise InputError("damaged: it ends before its last entry")
        self.at += count
        return rows

    def table(self, element: _Element) -> dict[str, NDArray[Any]]:
        """Return the columns of an element without lists."""
        rows = self._take(element.size)
        try:
            values = np.array(rows, dtype=np.float64).reshape(len(rows), len(element.properties))
        except ValueError as error:
            raise InputError(f"damaged: a {element.name} is not a row of numbers") from error
        columns = enumerate(element.properties)
        return {prop.name: values[:, k].astype(_TYPES[prop.kind]) for k, prop in columns}

    def triangles(self, element: _Element, vertices: str) -> _Faces | None:
        """Return the faces if each is a list of three corners and nothing else, else None."""
        if len(element.properties) > 1:
            return None
        rows = self.lines[self.at : self.at + element.size]
        if len(rows) < element.size or any(len(row) != 4 or row[0] != b"3" for row in rows):
            return None
        try:
            corners = np.array([row[1:] for row in rows], dtype=np.int64).reshape(-1)
        except (OverflowError, ValueError) as error:
            raise InputError("damaged: a face is not a list of numbers") from error
        self.at += len(rows)
        return np.full(len(rows), 3), corners, None

    def lists(self, element: _Element, vertices: str) -> _Faces:
        """Return the faces, read one by one."""
        counts: list[int] = []
        flat: list[int] = []
        guessed: list[bool] = []
        try:
            for row in self._take(element.size):
                at = 0
                for prop in element.properties:
                    if prop.count is None and prop.name == GUESSED:
                        guessed.append(float(row[at]) != 0)
                    if prop.count is None:
                        at += 1
                        continue
                    count = int(row[at])
                    if prop.name == vertices:
                        counts.append(count)
                        flat += map(int, row[at + 1 : at + 1 + count])
                    at += 1 + count
            corners = np.array(flat, dtype=np.int64)
        except (IndexError, OverflowError, ValueError) as error:
            raise InputError("damaged: a face is not a list of numbers") from error
        if sum(counts) != len(flat):
            raise InputError("damaged: a face has fewer corners than it declares")
        return np.array(counts, dtype=np.int64), corners, np.array(guessed) if guessed else None

    def skip(self, element: _Element) -> None:
        """Step over an element."""
        self._take(element.size)
