/** Reading a tier: over HTTP, or from its script twin where the page was opened from disk. */

import { Box3, BufferAttribute, BufferGeometry, Sphere, Vector3 } from "three";
import type { Texture } from "three";
import type { Background } from "./background";
import { revived } from "./front";
import type { Front } from "./front";
import { say } from "./languages";
import type { Net, Packed, Picture, Surface } from "./surface";
import type { Tables } from "./types";
import { mapOf } from "./upload";

/** One drawable part of the wall: positions in the scan's frame (metres, z up). */
export interface Part {
  geometry: BufferGeometry;
  map: Texture | null;
  /** What fills the map. */
  picture: Picture | null;
  coloured: boolean;
}

export interface Wall {
  /** Address of its file. */
  source: string;
  parts: Part[];
  box: Box3;
  tables: Tables;
  front: Front;
  /** The highest feature id in the geometry; 0 when the file carries no ids. */
  most: number;
}

declare global {
  interface Window {
    wallTopoTiers?: Record<string, string>;
  }
}

/** In base64: turning it into bytes is the worker's. */
function fromScript(url: string): Promise<string> {
  const name = url.split("/").pop() ?? url;
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = url.replace(/\.glb$/, ".js");
    script.onerror = () => reject(new Error(say().noTwin(script.src)));
    script.onload = () => {
      script.remove();
      const text = window.wallTopoTiers?.[name];
      if (text === undefined) return reject(new Error(say().emptyTwin(script.src)));
      delete window.wallTopoTiers?.[name];
      resolve(text);
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
  if (absolute.protocol === "file:") return fromScript(absolute.href);
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

function attribute({ array, size, normalized }: Packed): BufferAttribute {
  return new BufferAttribute(array, size, normalized);
}

function partOf(surface: Surface): Part {
  const { position, feature, depth, index, uv, color, picture } = surface;
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(position, 3));
  geometry.setAttribute("feature", new BufferAttribute(feature, 1));
  // Until the smooth borders are found (borders.ts), holds end where their triangles do.
  geometry.setAttribute("near", new BufferAttribute(feature.slice(), 1));
  geometry.setAttribute("depth", new BufferAttribute(depth, 1));
  if (uv) geometry.setAttribute("uv", attribute(uv));
  if (color) geometry.setAttribute("color", attribute(color));
  geometry.setIndex(new BufferAttribute(index, 1));
  geometry.boundingBox = new Box3(new Vector3(...surface.low), new Vector3(...surface.high));
  geometry.boundingSphere = geometry.boundingBox.getBoundingSphere(new Sphere());
  return { geometry, map: picture && mapOf(picture), picture, coloured: color !== null };
}

/** A part as the worker takes it. */
export function netOf(geometry: BufferGeometry): Net {
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

export interface Reading {
  /** Gets a share from 0 to 1 while the file comes, where its size is known. */
  progress?: (share: number) => void;
  /** Of a wall whose file says none. */
  title?: string;
  signal: AbortSignal;
}

/** Fetch a GLB and turn it into what is drawn and its tables; rejects with an Error whose message people can read. */
export async function readWall(reader: Background, source: string, reading: Reading): Promise<Wall> {
  const { progress = () => {}, title = "", signal } = reading;
  const bytes = await fetchBytes(source, progress, signal);
  progress(1);
  const handed = typeof bytes === "string" ? [] : [bytes];
  const { surfaces, tables, most, front } = await reader.ask("read", { source: bytes, title }, handed);
  const parts = surfaces.map(partOf);
  const box = new Box3();
  for (const { geometry } of parts) box.union(geometry.boundingBox!);
  return { source, parts, box, tables, most, front: revived(front) };
}
