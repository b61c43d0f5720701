/** The meaning of a tap on "Top": a new ascent, or a change of today's. */

import type { Discipline, Kind } from "./kinds";
import type { OwnAscent } from "./logbook.svelte";
import type { AscentIn } from "./store";

export interface Change {
  id: string;
  /** The new state; null: withdrawn. */
  after: AscentIn | null;
  /** The earlier state; null: none. */
  before: AscentIn | null;
  known: boolean;
}

/** A tap on a result; `clip`: of a high point. */
export interface Tap {
  kind: Kind;
  discipline: Discipline;
  clip?: number | null;
}

export function words({ route_id, kind, tries, discipline, high_point = null, climbed_at, note }: AscentIn): AscentIn {
  return { route_id, kind, tries, ...(discipline ? { discipline } : {}), high_point, climbed_at, note };
}

/**
 * Tries of one day are one line: a further one counts up, a top completes it. A second tap on "Project" removes it.
 * `own`: one's ascents of the route.
 */
export function change(route: string, { kind, discipline, clip = null }: Tap, own: OwnAscent[], now: Date, id: string): Change {
  const climbed_at = now.toISOString();
  if (kind === "project") {
    const marked = own.find((row) => row.kind === "project");
    if (marked) return { id: marked.id, after: null, before: words(marked), known: marked.known };
  }
  const isToday = (row: OwnAscent): boolean => new Date(row.climbed_at).toDateString() === now.toDateString();
  const tried = own.find((row) => row.kind === "try" && (row.discipline ?? discipline) === discipline && isToday(row));
  const made = { kind, discipline, high_point: clip, climbed_at };
  if (tried && ["try", "zone", "hang", "high-point", "top"].includes(kind)) {
    return { id: tried.id, after: { ...words(tried), ...made, tries: tried.tries + 1 }, before: words(tried), known: tried.known };
  }
  return { id, after: { route_id: route, ...made, tries: 1, note: "" }, before: null, known: false };
}
