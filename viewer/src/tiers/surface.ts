/** A wall as plain arrays, which the worker that reads it sends to the page that draws it. */

import type { Framing } from "../camera/framing";
import type { Tables, Vec3 } from "../data/types";
import type { SurfaceLabels } from "../data/wire";
import type { Patches } from "../geometry/labels";

/** Numbers of a vertex, as the GPU takes them. */
export interface Packed {
  array: Float32Array | Int8Array | Uint8Array | Int16Array | Uint16Array;
  size: number;
  normalized: boolean;
}

/** A mesh: positions in the scan's frame (metres, z up), three indices a triangle. */
export interface TriangleMesh {
  position: Float32Array;
  index: Uint16Array | Uint32Array;
  /** Feature id of each vertex, 0 = wall. */
  feature: Float32Array;
}

export interface Picture {
  /** Number of the picture that the reader keeps until its last row was read (`texture_strips.ts`). */
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
export interface Surface extends TriangleMesh {
  uv: Packed | null;
  color: Packed | null;
  picture: Picture | null;
  /** The surface as its file has it. */
  patches: Patches;
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
  /** The surface's part of the labels file; null if the tier's own file has labels. */
  labels: SurfaceLabels | null;
  /** The direction that the wall faces; vectors from the worker are plain objects. */
  framing: Framing;
  /** The highest feature id in the geometry; 0 when the file carries no ids. */
  most: number;
}
