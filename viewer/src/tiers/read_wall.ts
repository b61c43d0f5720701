/** Reading a tier: over HTTP, or from its script twin where the page was opened from disk. */

import { Box3, BufferAttribute, BufferGeometry, Sphere, Vector3 } from "three";
import type { Texture } from "three";
import { restoredFraming } from "../camera/framing";
import type { Framing } from "../camera/framing";
import type { Tables } from "../data/types";
import { Labels } from "../geometry/labels";
import type { Patches } from "../geometry/labels";
import { say } from "../languages";
import type { TriangleMesh, Packed, Picture, Surface } from "./surface";
import { emptyTexture } from "./texture_upload";
import type { WorkerClient } from "./worker_client";

/** One drawable part of the wall: positions in the scan's frame (metres, z up). */
export interface Part {
  geometry: BufferGeometry;
  map: Texture | null;
  /** The picture that fills the map. */
  picture: Picture | null;
  coloured: boolean;
  /** The part as its file has it. */
  patches: Patches;
}

/** A tier that can be drawn. */
export interface WallModel {
  /** Address of its file. */
  source: string;
  parts: Part[];
  box: Box3;
  tables: Tables;
  /** Labels from beside the file; null where the file itself has them. */
  labels: Labels | null;
  framing: Framing;
  /** The highest feature id in the geometry; 0 when the file carries no ids. */
  most: number;
}

declare global {
  interface Window {
    wallTopoTiers?: Record<string, unknown>;
  }
}

/** A tier in base64 (turning it into bytes is the worker's), or labels. */
function fromScript(url: string): Promise<unknown> {
  const name = url.split("/").pop() ?? url;
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = url.replace(/\.(glb|json)$/, ".js");
    script.onerror = () => reject(new Error(say().noTwin(script.src)));
    script.onload = () => {
      script.remove();
      const found = window.wallTopoTiers?.[name];
      if (found === undefined) return reject(new Error(say().emptyTwin(script.src)));
      delete window.wallTopoTiers?.[name];
      resolve(found);
    };
    document.head.append(script);
  });
}

/** The bytes of a file, or their base64; `progress` gets a share from 0 to 1 where the size is known. */
async function fetchBytes(
  url: string,
  progress: (share: number) => void,
  signal: AbortSignal,
): Promise<ArrayBuffer | string> {
  const absolute = new URL(url, document.baseURI);
  if (absolute.protocol === "file:") return (await fromScript(absolute.href)) as string;
  const response = await fetch(absolute, { signal });
  if (!response.ok) throw new Error(`${say().answered(response.status)} (${url})`);
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

/** The file beside a tier that has its labels; null if it names none. The worker refuses other files. */
function labelsNamed(bytes: ArrayBuffer | string): string | null {
  const HEAD = 20; // bytes before the document
  const part = (count: number): Uint8Array =>
    typeof bytes === "string"
      ? Uint8Array.from(atob(bytes.slice(0, 4 * Math.ceil(count / 3))), (letter) => letter.charCodeAt(0)).subarray(0, count)
      : new Uint8Array(bytes, 0, count);
  try {
    const length = new DataView(part(HEAD).slice().buffer).getUint32(12, true);
    const { scene = 0, scenes } = JSON.parse(new TextDecoder().decode(part(HEAD + length).subarray(HEAD)));
    const name: unknown = scenes[scene].extras.walltopo.labels;
    return typeof name === "string" && /^[\w-][\w.-]*$/.test(name) ? name : null;
  } catch {
    return null;
  }
}

/** The labels beside a tier; read once for all tiers of a reader. */
function labelsOf(reader: WorkerClient, url: URL, signal: AbortSignal): Promise<unknown> {
  const known = reader.labels.get(url.href);
  if (known) return known;
  const coming = url.protocol === "file:" ? fromScript(url.href) : fetchJson(url, signal);
  reader.labels.set(url.href, coming);
  return coming;
}

async function fetchJson(url: URL, signal: AbortSignal): Promise<unknown> {
  const response = await fetch(url, { signal });
  if (!response.ok) throw new Error(`${say().answered(response.status)} (${url.pathname})`);
  return response.json();
}

function attribute({ array, size, normalized }: Packed): BufferAttribute {
  return new BufferAttribute(array, size, normalized);
}

function partOf(surface: Surface): Part {
  const { position, feature, depth, index, uv, color, picture, patches } = surface;
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(position, 3));
  geometry.setAttribute("feature", new BufferAttribute(feature, 1));
  // Until the smooth borders are found (hold_borders.ts), holds end where their triangles do.
  geometry.setAttribute("near", new BufferAttribute(feature.slice(), 1));
  geometry.setAttribute("depth", new BufferAttribute(depth, 1));
  if (uv) geometry.setAttribute("uv", attribute(uv));
  if (color) geometry.setAttribute("color", attribute(color));
  geometry.setIndex(new BufferAttribute(index, 1));
  geometry.boundingBox = new Box3(new Vector3(...surface.low), new Vector3(...surface.high));
  geometry.boundingSphere = geometry.boundingBox.getBoundingSphere(new Sphere());
  return { geometry, map: picture && emptyTexture(picture), picture, coloured: color !== null, patches };
}

/** A part as the worker takes it. */
export function meshOf(geometry: BufferGeometry): TriangleMesh {
  return {
    position: geometry.getAttribute("position").array as Float32Array,
    feature: geometry.getAttribute("feature").array as Float32Array,
    index: geometry.getIndex()!.array as Uint32Array,
  };
}

/** Why a wall did not load, for people. A typed array that cannot be had is a RangeError. */
export function reasonOf(error: unknown): string {
  if (error instanceof RangeError) return say().words.tooLarge;
  return (error as Error).message;
}

export interface ReadOptions {
  /** Gets a share from 0 to 1 while the file comes, where its size is known. */
  progress?: (share: number) => void;
  /** The title of a wall whose file has none. */
  title?: string;
  signal: AbortSignal;
}

/** Fetch a GLB and turn it into what is drawn and its tables; rejects with an Error whose message people can read. */
export async function readWall(reader: WorkerClient, source: string, options: ReadOptions): Promise<WallModel> {
  const { progress = () => {}, title = "", signal } = options;
  const bytes = await fetchBytes(source, progress, signal);
  progress(1);
  const named = labelsNamed(bytes);
  const file = named === null ? undefined : await labelsOf(reader, new URL(named, new URL(source, document.baseURI)), signal);
  const handed = typeof bytes === "string" ? [] : [bytes];
  const { surfaces, tables, labels: raw, most, framing } = await reader.ask("read", { source: bytes, title, labels: file }, handed);
  const labels = raw && new Labels(raw);
  const parts = surfaces.map(partOf);
  const box = new Box3();
  for (const { geometry } of parts) box.union(geometry.boundingBox!);
  return { source, parts, box, tables, labels, most, framing: restoredFraming(framing) };
}
