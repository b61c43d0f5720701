/** Reading a GLB, in the worker: bytes to the arrays that the GPU takes. */

import { Box3, Matrix4, Mesh, Vector3 } from "three";
import type { BufferAttribute, InterleavedBufferAttribute, MeshBasicMaterial } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
import { frontOf } from "./front";
import { pictureOf } from "./strips";
import type { Packed, Surface, Tier } from "./surface";
import { tablesOf } from "./tables";

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

function surfaceOf(mesh: Mesh): Surface {
  const { geometry } = mesh;
  const position = placesOf(geometry.getAttribute("position"), TO_Z_UP.clone().multiply(mesh.matrixWorld));
  const count = position.length / 3;
  const ids = geometry.getAttribute("_feature_id_0") as Attribute | undefined;
  const feature = new Float32Array(count);
  if (ids) for (let k = 0; k < count; k++) feature[k] = ids.getX(k);
  const given = geometry.getIndex()?.array;
  const index = given instanceof Uint16Array ? given : given ? new Uint32Array(given) : Uint32Array.from(feature.keys());
  const uv = packed(geometry.getAttribute("uv"));
  const box = new Box3().setFromArray(position);
  return {
    position,
    index,
    feature,
    depth: feature.map((id) => (id > 0 ? 1 : -1)),
    uv,
    color: packed(geometry.getAttribute("color")),
    picture: uv && pictureOf((mesh.material as MeshBasicMaterial).map),
    low: box.min.toArray(),
    high: box.max.toArray(),
  };
}

export interface Source {
  source: ArrayBuffer | string;
  /** For a file that says none. */
  title: string;
}

/** A tier from its bytes (or their base64). Throws an Error: a key of `words`, or what a library says. */
export async function read({ source, title }: Source): Promise<Tier> {
  const bytes = typeof source === "string" ? bytesOf(source) : source;
  const magic = new Uint8Array(bytes.slice(0, 4));
  if (String.fromCharCode(...magic) !== "glTF") throw new Error("noGlb");
  const gltf = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes, "");
  gltf.scene.updateMatrixWorld(true);
  const surfaces: Surface[] = [];
  gltf.scene.traverse((node) => {
    if (node instanceof Mesh) surfaces.push(surfaceOf(node));
  });
  if (surfaces.length === 0) throw new Error("noSurface");
  const tables = tablesOf((gltf.scene.userData["walltopo"] ?? {}) as Record<string, unknown>, title);
  const box = new Box3();
  let most = 0;
  for (const { low, high, feature } of surfaces) {
    box.expandByPoint(new Vector3(...low)).expandByPoint(new Vector3(...high));
    for (const id of feature) if (id > most) most = id;
  }
  return { surfaces, tables, most, front: frontOf({ surfaces, tables, box }) };
}

/** What of a tier can be handed over instead of copied. */
export function buffersOf({ surfaces }: Tier): Transferable[] {
  return surfaces.flatMap(({ position, index, feature, depth, uv, color }) =>
    [position, index, feature, depth, uv?.array, color?.array].flatMap((array) => (array ? [array.buffer as ArrayBuffer] : [])),
  );
}
