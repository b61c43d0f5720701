/** What a log of edits makes of the scan, as the server tells it (`walltopo.editing.result`). */

import { tablesOf } from "../tables";
import type { Hold, Tables, Vec3 } from "../types";

/** An entry of the log that does nothing, and why. */
export interface Note {
  /** Its number, from 1. */
  entry: number;
  /** A key of the languages' `notes`, and the numbers of holds and routes in it. */
  reason: string;
  numbers: number[];
  /** All of it in English. */
  text: string;
}

/** Base64 of little-endian numbers. */
export interface RawRegion {
  at: Vec3;
  radius_m: number;
  centroids: string;
  labels: string;
}

export interface RawResult {
  holds: (Hold & { left_out: string })[];
  routes: unknown[];
  surface: { regions: RawRegion[] } | null;
  notes: Note[];
}

/** Triangles of the mesh in a ball of the surface, by their middles, and whose they are now. */
export interface Region {
  at: Vec3;
  radius: number;
  centroids: Float32Array;
  labels: Int32Array;
}

export interface Result {
  tables: Tables;
  /** Instances that are no holds, with the reason. */
  leftOut: Map<number, Hold>;
  regions: Region[];
  notes: Note[];
}

function buffer(text: string): ArrayBuffer {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

/** `base`: what the page's own tables say of the whole wall. */
export function resultOf(raw: RawResult, base: Tables): Result {
  const { title, metric } = base;
  const kept = raw.holds.filter(({ left_out }) => !left_out);
  const others = raw.holds.filter(({ left_out }) => left_out);
  const regions = (raw.surface?.regions ?? []).map(({ at, radius_m, centroids, labels }) => ({
    at,
    radius: radius_m,
    centroids: new Float32Array(buffer(centroids)),
    labels: new Int32Array(buffer(labels)),
  }));
  return {
    tables: tablesOf({ holds: kept, routes: raw.routes, title, metric }, title),
    leftOut: tablesOf({ holds: others }, "").holds,
    regions,
    notes: raw.notes,
  };
}
