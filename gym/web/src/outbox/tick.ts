/** The meaning of a tap on "Top": a new ascent, or a change of today's. */

import type { OwnAscent } from "./logbook.svelte";
import type { AscentIn, Kind } from "./store";

export interface Change {
  id: string;
  /** The new state; null: withdrawn. */
  after: AscentIn | null;
  /** The earlier state; null: none. */
  before: AscentIn | null;
  known: boolean;
}

function words({ route_id, kind, tries, climbed_at, note }: AscentIn): AscentIn {
  return { route_id, kind, tries, climbed_at, note };
}

/**
 * Tries of one day are one line: a further one counts up, a top completes it. A second tap on "Project" removes it.
 * `own`: one's ascents of the route.
 */
export function change(route: string, kind: Kind, own: OwnAscent[], now: Date, id: string): Change {
  const climbed_at = now.toISOString();
  if (kind === "project") {
    const marked = own.find((row) => row.kind === "project");
    if (marked) return { id: marked.id, after: null, before: words(marked), known: marked.known };
  }
  const isToday = (row: OwnAscent): boolean => new Date(row.climbed_at).toDateString() === now.toDateString();
  const tried = own.find((row) => row.kind === "try" && isToday(row));
  if (tried && ["try", "zone", "top"].includes(kind)) {
    return { id: tried.id, after: { ...words(tried), kind, tries: tried.tries + 1, climbed_at }, before: words(tried), known: tried.known };
  }
  return { id, after: { route_id: route, kind, tries: 1, climbed_at, note: "" }, before: null, known: false };
}
