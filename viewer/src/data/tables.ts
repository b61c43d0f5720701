/** The tables that a tier carries, checked: any program can write a GLB. */

import type { Hold, Route, Tables, Vec3 } from "./types";
import type { SurfaceLabels } from "./wire";

function isPlace(value: unknown): value is Vec3 {
  return Array.isArray(value) && value.length === 3 && value.every((v) => Number.isFinite(v));
}

/** Rows with a whole number as id; what else lies there is another program's. */
function rowsOf<T extends { id: number }>(value: unknown): T[] {
  const rows = (Array.isArray(value) ? value : []) as (T | null)[];
  return rows.filter((row): row is T => Number.isInteger(row?.id) && row!.id >= 0);
}

/** The part of `labels.json` that the viewer uses. */
export interface LabelsFile extends Record<string, unknown> {
  surface: SurfaceLabels;
}

const isNumbers = (value: unknown): value is number[] => Array.isArray(value) && value.every((v) => Number.isFinite(v));
const isPlaces = (value: unknown): boolean => isNumbers(value) && value.length % 3 === 0;

/** `labels.json`, checked; throws an Error: a key of `words`. */
export function labelsFileOf(raw: unknown): LabelsFile {
  const file = raw as LabelsFile | null;
  const surface = file?.surface;
  const whole =
    surface &&
    Array.isArray(surface.patches) &&
    surface.patches.every((pair) => isNumbers(pair) && pair.length === 2) &&
    Array.isArray(surface.changed) &&
    surface.changed.every(({ label, places }) => Number.isInteger(label) && isPlaces(places)) &&
    isPlaces(surface.unchanged) &&
    isPlace(surface.origin) &&
    surface.step > 0 &&
    surface.edge > 0;
  if (!whole) throw new Error("noLabels");
  return file;
}

/** The tables in the `walltopo` object of a scene's extras, or in `labels.json`. */
export function tablesOf(raw: Record<string, unknown>, title: string): Tables {
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
