"""Write `wall.glb` and the page's tiers: a surface, its texture and its tables as one glTF file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.images.colour import linear_from_srgb8
from walltopo.publish.glb import GlbWriter
from walltopo.publish.surface import Surface
from walltopo.publish.tables import SCHEMA, hold_columns, origin_columns, route_columns
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route

# glTF is y up, the world z up: a rotation by -90 degrees about x, as a quaternion.
Z_UP_TO_Y_UP = [-0.7071067811865476, 0.0, 0.0, 0.7071067811865476]


@dataclass(frozen=True)
class Packing:
    """The storage format of the geometry.

    Parameters
    ----------
    quantised : 16-bit positions and texture coordinates (`KHR_mesh_quantization`).
    compressed : `EXT_meshopt_compression` in addition.
    normals : store smooth normals (for viewers that light the wall).
    """

    quantised: bool = False
    compressed: bool = False
    normals: bool = True


def _quantise_positions(
    positions: NDArray[np.float32],
) -> tuple[NDArray[np.uint16], dict[str, Any]]:
    """Return positions on a grid of 65,535 steps over the longest side, and the inverse node."""
    low = positions.min(axis=0).astype(np.float64)
    step = float(max((positions.max(axis=0) - low).max(), 1e-6)) / 65535.0
    grid = np.rint((positions - low) / step).astype(np.uint16)
    return grid, {"translation": low.tolist(), "scale": [step] * 3}


def _primitive_attributes(writer: GlbWriter, surface: Surface, packing: Packing) -> tuple[Any, Any]:
    """Return the primitive's attributes and the mesh node's transform."""
    node: dict[str, Any] = {}
    attributes: dict[str, int] = {}
    if packing.quantised:
        grid, node = _quantise_positions(surface.positions)
        attributes["POSITION"] = writer.attribute(grid, bounds=True)
        writer.use("KHR_mesh_quantization", required=True)
    else:
        attributes["POSITION"] = writer.attribute(surface.positions, bounds=True)
    if packing.normals:
        attributes["NORMAL"] = writer.attribute(surface.normals)
    if surface.uv is not None:
        if packing.quantised:
            grid = np.rint(np.clip(surface.uv, 0, 1) * 65535).astype(np.uint16)
            attributes["TEXCOORD_0"] = writer.attribute(grid, normalized=True)
        else:
            attributes["TEXCOORD_0"] = writer.attribute(surface.uv)
    if surface.colours is not None:
        attributes["COLOR_0"] = writer.attribute(_linear_colours(surface.colours), normalized=True)
    attributes["_FEATURE_ID_0"] = writer.attribute(_ids(surface.feature))
    if surface.guessed is not None:
        attributes["_FEATURE_ID_1"] = writer.attribute(surface.guessed)
    return attributes, node


def _ids(feature: NDArray[np.int32]) -> NDArray[Any]:
    # glTF has no 32-bit integer attributes; float is exact up to 2**24 ids.
    wide = int(feature.max(initial=0)) > 65535
    return feature.astype(np.float32) if wide else feature.astype(np.uint16)


def _linear_colours(colours: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return sRGB bytes as linear 16-bit values, because glTF's vertex colours are linear."""
    return np.rint(linear_from_srgb8(colours) * 65535.0).astype(np.uint16)


def _feature_ids(attribute: int, label: str, count: int, table: int) -> dict[str, Any]:
    """Return an entry of `EXT_mesh_features`: the attribute with the row numbers of a table."""
    return {"featureCount": count, "attribute": attribute, "propertyTable": table, "label": label}


def _material_entries(
    writer: GlbWriter, surface: Surface, picture: tuple[bytes, str] | None
) -> Any:
    """Return material, texture and image entries; unlit, because photos include the light."""
    pbr: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
    material: dict[str, Any] = {"name": "wall", "pbrMetallicRoughness": pbr}
    entries: dict[str, Any] = {"materials": [material]}
    if picture is not None or surface.colours is not None:
        writer.use("KHR_materials_unlit")
        material["extensions"] = {"KHR_materials_unlit": {}}
    if picture is None:
        return entries
    data, mime = picture
    pbr["baseColorTexture"] = {"index": 0}
    entries["images"] = [{"bufferView": writer.view(data), "mimeType": mime, "name": "texture"}]
    entries["samplers"] = [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}]
    texture: dict[str, Any] = {"sampler": 0, "source": 0}
    if mime == "image/webp":
        writer.use("EXT_texture_webp", required=True)
        texture = {"sampler": 0, "extensions": {"EXT_texture_webp": {"source": 0}}}
    entries["textures"] = [texture]
    return entries


def _scene_extras(
    holds: Sequence[Hold], routes: Sequence[Route], title: str, metric: bool
) -> dict[str, Any]:
    """Return what readers without property tables get: the rows as JSON."""
    return {
        "version": 1,
        "title": title,
        "metric": metric,
        "holds": msgspec.to_builtins(list(holds)),
        "routes": msgspec.to_builtins(list(routes)),
    }


def _primitive(
    attributes: dict[str, int], indices: int, features: list[dict[str, Any]]
) -> dict[str, Any]:
    return {
        "attributes": attributes,
        "indices": indices,
        "material": 0,
        "extensions": {"EXT_mesh_features": {"featureIds": features}},
    }


def write_glb(
    surface: Surface,
    holds: Sequence[Hold],
    routes: Sequence[Route],
    *,
    picture: tuple[bytes, str] | None = None,
    packing: Packing | None = None,
    metric: bool = True,
    title: str = "Wall",
    labels: str = "",
) -> bytes:
    """Return one GLB file.

    Parameters
    ----------
    surface : triangles with hold ids.
    holds, routes : rows of `holds.json` and `routes.json`. They become property tables, and the
        same JSON is stored in the scene's `extras.walltopo`.
    picture : encoded texture and its MIME type; used if the surface has texture coordinates.
    labels : name of a file beside this one that has title, tables and labels instead; the ids of
        the surface are then patches, see `walltopo.scans.page_labels`.
    """
    packing = packing or Packing()
    writer = GlbWriter(compress=packing.compressed)
    attributes, transform = _primitive_attributes(writer, surface, packing)
    indices = writer.indices(surface.triangles, len(surface.positions))
    max_id = int(surface.feature.max(initial=0))
    tables: list[dict[str, Any]] = []
    if labels:
        features = [{"featureCount": max_id + 1, "attribute": 0, "label": "patch"}]
        extras: dict[str, Any] = {"version": 1, "labels": labels}
    else:
        columns = hold_columns(holds, max_id)
        tables.append(writer.property_table("holds", "hold", columns))
        if routes:
            tables.append(writer.property_table("routes", "route", route_columns(routes)))
        features = [_feature_ids(0, "hold", len(columns[0].values), 0)]
        extras = _scene_extras(holds, routes, title, metric)
    writer.use("EXT_mesh_features")
    if surface.guessed is not None:
        features.append(_feature_ids(1, "origin", 2, len(tables)))
        tables.append(writer.property_table("origin", "origin", origin_columns(surface)))
    metadata = {"EXT_structural_metadata": {"schema": SCHEMA, "propertyTables": tables}}
    if tables:
        writer.use("EXT_structural_metadata")
    document = {
        "asset": {"version": "2.0", "generator": "walltopo"},
        "scene": 0,
        "scenes": [{"name": title, "nodes": [0], "extras": {"walltopo": extras}}],
        "nodes": [
            {"name": "wall", "rotation": Z_UP_TO_Y_UP, "children": [1]},
            {"name": "mesh", "mesh": 0, **transform},
        ],
        "meshes": [{"name": "wall", "primitives": [_primitive(attributes, indices, features)]}],
        **({"extensions": metadata} if tables else {}),
        **_material_entries(writer, surface, picture if surface.uv is not None else None),
    }
    return writer.finish(document)
