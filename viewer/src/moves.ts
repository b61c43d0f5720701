/** `moves.json`: how each route may be climbed, where `walltopo moves` wrote it beside the page. */

import type { Tables, Vec3 } from "./types";

/** Left hand, right hand, left foot, right foot. */
export type Limbs = [number, number, number, number];

export interface Move {
  limb: "start" | "left hand" | "right hand" | "left foot" | "right foot";
  /** Hold ids afterwards; 0: on none. */
  holds: Limbs;
  hip: Vec3;
  effort: number;
  /** Metres beyond reach: a leap. */
  beyond_m?: number;
}

export interface Climber {
  climber: string;
  height_m: number;
  span_m: number;
  reached: boolean;
  crux: number;
  moves: Move[];
}

export interface RouteMoves {
  route: number;
  climbers: Climber[];
  grade?: { low: string; high: string; coverage: number; graded?: number } | null;
}

export interface Moves {
  /** Units of the scan that a metre is. */
  unit: number;
  routes: Map<number, RouteMoves>;
}

interface File {
  unit?: number;
  routes?: RouteMoves[];
}

declare global {
  interface Window {
    wallTopoMoves?: File;
  }
}

/** The moves beside the page; null where there are none, or none that can be read. */
export async function readMoves(url: string, tables: Tables, signal: AbortSignal): Promise<Moves | null> {
  const absolute = new URL(url, document.baseURI);
  let file: File | null;
  try {
    file = absolute.protocol === "file:" ? await fromScript(absolute.href) : await fetched(absolute, signal);
  } catch {
    return null; // nobody ran `walltopo moves`: nothing is missing
  }
  if (!file || !Array.isArray(file.routes)) return null;
  const whole = file.routes.filter((one) => fits(one, tables));
  return { unit: file.unit ?? 1, routes: new Map(whole.map((one) => [one.route, one])) };
}

async function fetched(url: URL, signal: AbortSignal): Promise<File | null> {
  const response = await fetch(url, { signal });
  return response.ok ? ((await response.json()) as File) : null;
}

function fromScript(url: string): Promise<File | null> {
  return new Promise((resolve) => {
    const script = document.createElement("script");
    script.src = url.replace(/\.json$/, ".js");
    script.onerror = () => resolve(null);
    script.onload = () => {
      script.remove();
      resolve(window.wallTopoMoves ?? null);
    };
    document.head.append(script);
  });
}

/** Whether the route and all of its holds are still there: edits may have changed them since. */
function fits(one: RouteMoves, tables: Tables): boolean {
  const route = tables.routes.get(one?.route);
  if (!route || !Array.isArray(one.climbers)) return false;
  return one.climbers.every(({ moves }) =>
    moves.every(({ holds }) => holds.every((id) => id === 0 || tables.holds.has(id))),
  );
}
