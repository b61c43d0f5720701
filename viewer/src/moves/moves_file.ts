/** `moves.json`: how each route may be climbed, where `walltopo moves` wrote it beside the page. */

import type { Tables } from "../data/types";
import type { ClimberRow, Moves as MovesFile, RouteMoves } from "../data/wire";

export interface Moves {
  /** Units of the scan that a metre is. */
  unit: number;
  routes: Map<number, RouteMoves>;
}

/** Height and arm span in metres; without a span, as the height. */
export interface Person {
  height_m: number;
  span_m?: number | null;
}

// Shares of height and arm span in how high the fingers reach: shoulders at 0.818 of the height, arms of 0.415 of it
// and half of what the span exceeds it (walltopo_climb/movement/body.py).
const [OF_HEIGHT, OF_SPAN] = [0.733, 0.5];

/** The climber who reaches about as high as a person; the lower one of two. */
export function nearestClimber(climbers: ClimberRow[], person: Person): ClimberRow {
  const reach = (height: number, span: number): number => OF_HEIGHT * height + OF_SPAN * span;
  const wanted = reach(person.height_m, person.span_m ?? person.height_m);
  const off = (one: ClimberRow): number => Math.abs(reach(one.height_m, one.span_m) - wanted);
  return climbers.reduce((best, one) => (off(one) < off(best) ? one : best));
}

type File = Partial<MovesFile>;

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
