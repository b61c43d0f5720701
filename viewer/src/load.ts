/** Reading a tier: over HTTP, or from its script twin where the page was opened from disk. */

import { Box3, BufferAttribute, BufferGeometry, Matrix4, Mesh, Texture } from "three";
import type { MeshBasicMaterial, Object3D } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
import { say } from "./languages";
import type { Hold, Route, Tables, Vec3 } from "./types";

/** One drawable part of the wall: positions in the scan's frame (metres, z up). */
export interface Part {
  geometry: BufferGeometry;
  map: Texture | null;
  coloured: boolean;
}

export interface Wall {
  parts: Part[];
  box: Box3;
  tables: Tables;
  /** The highest feature id in the geometry; 0 when the file carries no ids. */
  most: number;
}

declare global {
  interface Window {
    wallTopoTiers?: Record<string, string>;
  }
}

// glTF is y up, scans are z up.
const TO_Z_UP = new Matrix4().set(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1);

function fromScript(url: string): Promise<ArrayBuffer> {
  const name = url.split("/").pop() ?? url;
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = url.replace(/\.glb$/, ".js");
    script.onerror = () => reject(new Error(`${script.src} is missing beside the page`));
    script.onload = () => {
      script.remove();
      const text = window.wallTopoTiers?.[name];
      if (text === undefined) return reject(new Error(`${script.src} holds no model`));
      delete window.wallTopoTiers?.[name];
      const raw = atob(text);
      const bytes = new Uint8Array(raw.length);
      for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
      resolve(bytes.buffer);
    };
    document.head.append(script);
  });
}

/** The bytes of a file; `progress` gets a share from 0 to 1 where the size is known. */
export async function fetchBytes(
  url: string,
  progress: (share: number) => void,
  signal?: AbortSignal,
): Promise<ArrayBuffer> {
  const absolute = new URL(url, document.baseURI);
  if (absolute.protocol === "file:") return fromScript(absolute.href);
  const response = await fetch(absolute, { signal });
  if (!response.ok) throw new Error(`the server answered ${response.status} for ${url}`);
  const total = Number(response.headers.get("content-length"));
  if (!response.body || !total) return response.arrayBuffer();
  const chunks: Uint8Array[] = [];
  let got = 0;
  const reader = response.body.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    chunks.push(value);
    got += value.length;
    progress(Math.min(1, got / total));
  }
  const bytes = new Uint8Array(got);
  let at = 0;
  for (const chunk of chunks) {
    bytes.set(chunk, at);
    at += chunk.length;
  }
  return bytes.buffer;
}

function partOf(mesh: Mesh): Part {
  const source = mesh.geometry;
  const position = source.getAttribute("position");
  const count = position.count;
  const places = new Float32Array(count * 3);
  for (let k = 0; k < count; k++) {
    places[3 * k] = position.getX(k);
    places[3 * k + 1] = position.getY(k);
    places[3 * k + 2] = position.getZ(k);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(places, 3));
  geometry.applyMatrix4(new Matrix4().multiplyMatrices(TO_Z_UP, mesh.matrixWorld));
  const feature = source.getAttribute("_feature_id_0");
  const ids = new Float32Array(count);
  if (feature) for (let k = 0; k < count; k++) ids[k] = feature.getX(k);
  geometry.setAttribute("feature", new BufferAttribute(ids, 1));
  // Until the smooth borders are found (borders.ts), holds end where their triangles do.
  geometry.setAttribute("near", new BufferAttribute(ids.slice(), 1));
  geometry.setAttribute("depth", new BufferAttribute(ids.map((id) => (id > 0 ? 1 : -1)), 1));
  const uv = source.getAttribute("uv");
  const color = source.getAttribute("color");
  if (uv) geometry.setAttribute("uv", uv);
  if (color) geometry.setAttribute("color", color);
  geometry.setIndex(source.getIndex() ?? [...Array(count).keys()]);
  const material = mesh.material as MeshBasicMaterial;
  return { geometry, map: uv ? (material.map ?? null) : null, coloured: Boolean(color) };
}

function isPlace(value: unknown): value is Vec3 {
  return Array.isArray(value) && value.length === 3 && value.every((v) => Number.isFinite(v));
}

/** Rows with a whole number as id; what else lies there is another program's. */
function rowsOf<T extends { id: number }>(value: unknown): T[] {
  const rows = (Array.isArray(value) ? value : []) as (T | null)[];
  return rows.filter((row): row is T => Number.isInteger(row?.id) && row!.id >= 0);
}

function tablesOf(scene: Object3D, title: string): Tables {
  const raw = (scene.userData["walltopo"] ?? {}) as Record<string, unknown>;
  const holds = new Map<number, Hold>();
  for (const hold of rowsOf<Hold>(raw["holds"])) {
    if (!isPlace(hold.position)) continue;
    if (!isPlace(hold.normal)) hold.normal = [0, 0, 0];
    if (!isPlace(hold.colour_rgb)) hold.colour_rgb = null;
    const type = hold.type === "foot" ? "foothold" : (hold.type ?? null); // its name before 0.1
    holds.set(hold.id, { ...hold, type, route: hold.route ?? null, score: hold.score ?? 0 });
  }
  const routes = new Map<number, Route>();
  for (const route of rowsOf<Route>(raw["routes"])) {
    const known = (Array.isArray(route.holds) ? route.holds : []).filter((id) => holds.has(id));
    if (known.length === 0) continue;
    routes.set(route.id, { ...route, holds: known });
  }
  for (const hold of holds.values()) {
    if (hold.route !== null && !routes.has(hold.route)) hold.route = null;
  }
  for (const { id, holds: members } of routes.values()) {
    for (const member of members) holds.get(member)!.route ??= id;
  }
  const heading = typeof raw["title"] === "string" ? raw["title"] : title;
  return { title: heading, metric: raw["metric"] !== false, holds, routes };
}

/** Why a wall did not load, for people. A typed array that cannot be had is a RangeError. */
export function reasonOf(error: unknown): string {
  if (error instanceof RangeError) return say().words.tooLarge;
  return (error as Error).message;
}

/** Turn a GLB into parts, box and tables; throws an Error whose message people can read. */
export async function parseWall(bytes: ArrayBuffer, title: string): Promise<Wall> {
  const magic = new Uint8Array(bytes.slice(0, 4));
  if (String.fromCharCode(...magic) !== "glTF") throw new Error("the file is not a GLB");
  const loader = new GLTFLoader();
  loader.setMeshoptDecoder(MeshoptDecoder);
  const gltf = await loader.parseAsync(bytes, "");
  gltf.scene.updateMatrixWorld(true);
  const parts: Part[] = [];
  gltf.scene.traverse((node) => {
    if (node instanceof Mesh) parts.push(partOf(node));
  });
  if (parts.length === 0) throw new Error("the file holds no surface");
  const box = new Box3();
  let most = 0;
  for (const part of parts) {
    part.geometry.computeBoundingBox();
    box.union(part.geometry.boundingBox!);
    for (const id of part.geometry.getAttribute("feature").array) if (id > most) most = id;
  }
  return { parts, box, tables: tablesOf(gltf.scene, title), most };
}
