/** What a wall is between the worker that reads it and the page that draws it: plain arrays. */

import type { Front } from "./front";
import type { Tables, Vec3 } from "./types";

/** Numbers of a vertex, as the GPU takes them. */
export interface Packed {
  array: Float32Array | Int8Array | Uint8Array | Int16Array | Uint16Array;
  size: number;
  normalized: boolean;
}

/** A mesh: positions in the scan's frame (metres, z up), three indices a triangle. */
export interface Net {
  position: Float32Array;
  index: Uint16Array | Uint32Array;
  /** Feature id of each vertex, 0 = wall. */
  feature: Float32Array;
}

export interface Picture {
  /** Of the picture that the reader keeps until all of it was asked for (`strips.ts`). */
  number: number;
  /** In pixels. */
  width: number;
  height: number;
  /** Wrapping and filters, as three.js numbers them. */
  wrapS: number;
  wrapT: number;
  magFilter: number;
  minFilter: number;
}

/** One drawable part of a wall. */
export interface Surface extends Net {
  uv: Packed | null;
  color: Packed | null;
  picture: Picture | null;
  /** How far inside its hold each vertex lies, until the smooth borders are found: holds end with their triangles. */
  depth: Float32Array;
  /** Corners of its box. */
  low: Vec3;
  high: Vec3;
}

/** A tier as the worker read it. */
export interface Tier {
  surfaces: Surface[];
  tables: Tables;
  /** Which way it faces; its vectors are plain objects once they came from the worker. */
  front: Front;
  /** The highest feature id in the geometry; 0 when the file carries no ids. */
  most: number;
}
