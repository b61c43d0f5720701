/** Reading a GLB, in the worker: bytes to the arrays that the GPU takes. */

import { Box3, Matrix4, Mesh, Vector3 } from "three";
import type { BufferAttribute, InterleavedBufferAttribute, MeshBasicMaterial } from "three";
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { framingOf } from "../camera/framing";
import { labelsFileOf, tablesOf } from "../data/tables";
import type { LabelsFile } from "../data/tables";
import { extended, labelled, Labels } from "../geometry/labels";
import type { Packed, Surface, Tier } from "./surface";
import { keepPicture } from "./texture_strips";

type Attribute = BufferAttribute | InterleavedBufferAttribute;

// glTF is y up, scans are z up.
const TO_Z_UP = new Matrix4().set(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1);

/** Base64, as pages opened from disk have their tiers, to bytes. */
function bytesOf(text: string): ArrayBuffer {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return bytes.buffer;
}

/** An attribute without gaps between its vertices. */
function packed(attribute: Attribute | undefined): Packed | null {
  if (!attribute) return null;
  const { itemSize: size, count, normalized } = attribute;
  if (!("isInterleavedBufferAttribute" in attribute)) {
    return { array: attribute.array as Packed["array"], size, normalized };
  }
  const { array: source, stride } = attribute.data;
  const array = new (source.constructor as new (length: number) => Packed["array"])(size * count);
  for (let k = 0; k < count; k++) {
    const from = k * stride + attribute.offset;
    for (let c = 0; c < size; c++) array[size * k + c] = source[from + c]!;
  }
  return { array, size, normalized };
}

function placesOf(position: Attribute, toWorld: Matrix4): Float32Array {
  const places = new Float32Array(3 * position.count);
  const place = new Vector3();
  for (let k = 0; k < position.count; k++) {
    place.fromBufferAttribute(position, k).applyMatrix4(toWorld).toArray(places, 3 * k);
  }
  return places;
}

/** With more vertices, in the middle between others. */
function grown(packed: Packed | null, count: number, parents: number[]): Packed | null {
  return packed && { ...packed, array: extended(packed.array, packed.size, count, parents) };
}

/** The mesh with labels; null: what its file has are labels. */
function surfaceOf(mesh: Mesh, labels: Labels | null): Surface {
  const { geometry } = mesh;
  const places = placesOf(geometry.getAttribute("position"), TO_Z_UP.clone().multiply(mesh.matrixWorld));
  const count = places.length / 3;
  const ids = geometry.getAttribute("_feature_id_0") as Attribute | undefined;
  const patch = new Float32Array(count);
  if (ids) for (let k = 0; k < count; k++) patch[k] = ids.getX(k);
  const given = geometry.getIndex()?.array;
  const triangles = given instanceof Uint16Array ? given : given ? new Uint32Array(given) : Uint32Array.from(patch.keys());
  const patches = { position: places, index: triangles, patch };
  const { index, feature, parents } = labels ? labelled(patches, labels) : { index: triangles, feature: patch, parents: [] };
  const position = parents.length ? extended(places, 3, count, parents) : places;
  const uv = grown(packed(geometry.getAttribute("uv")), count, parents);
  const box = new Box3().setFromArray(position);
  return {
    position,
    index,
    feature,
    depth: feature.map((id) => (id > 0 ? 1 : -1)),
    uv,
    color: grown(packed(geometry.getAttribute("color")), count, parents),
    picture: uv && keepPicture((mesh.material as MeshBasicMaterial).map),
    patches,
    low: box.min.toArray(),
    high: box.max.toArray(),
  };
}

export interface Source {
  source: ArrayBuffer | string;
  /** For a file that says none. */
  title: string;
  /** The file that it names for its labels, as JSON. */
  labels?: unknown;
}

/** A tier from its bytes (or their base64). Throws an Error: a key of `words`, or what a library says. */
export async function decodeTier({ source, title, labels: raw }: Source): Promise<Tier> {
  const bytes = typeof source === "string" ? bytesOf(source) : source;
  const magic = new Uint8Array(bytes.slice(0, 4));
  if (String.fromCharCode(...magic) !== "glTF") throw new Error("noGlb");
  const gltf = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes, "");
  gltf.scene.updateMatrixWorld(true);
  const file: LabelsFile | null = raw === undefined ? null : labelsFileOf(raw);
  const labels = file && new Labels(file.surface);
  const surfaces: Surface[] = [];
  gltf.scene.traverse((node) => {
    if (node instanceof Mesh) surfaces.push(surfaceOf(node, labels));
  });
  if (surfaces.length === 0) throw new Error("noSurface");
  const tables = tablesOf(file ?? (gltf.scene.userData["walltopo"] as Record<string, unknown>) ?? {}, title);
  const box = new Box3();
  let most = 0;
  for (const { low, high, feature } of surfaces) {
    box.expandByPoint(new Vector3(...low)).expandByPoint(new Vector3(...high));
    for (const id of feature) if (id > most) most = id;
  }
  return { surfaces, tables, labels: file?.surface ?? null, most, framing: framingOf({ surfaces, tables, box }) };
}

/** The buffers of a tier that can be transferred instead of copied. */
export function buffersOf({ surfaces }: Tier): Transferable[] {
  const buffers = surfaces.flatMap(({ position, index, feature, depth, uv, color, patches }) =>
    [position, index, feature, depth, uv?.array, color?.array, patches.position, patches.index, patches.patch].flatMap((array) =>
      array ? [array.buffer as ArrayBuffer] : [],
    ),
  );
  return [...new Set(buffers)]; // a tier that no edit changed is as its file has it
}
