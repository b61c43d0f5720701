/** Low-confidence holds and routes that nobody has corrected yet. */

import type { Hold, Route, Tables } from "../data/types";
import type { Edit } from "./edit_log";

export function lowConfidence(tables: Tables, entries: readonly Edit[]): (Hold | Route)[] {
  const holds = new Set<number>();
  const routes = new Set<number>();
  for (const entry of entries) {
    if (entry.do === "role") routes.add(entry.route.id);
    else if ("hold" in entry) holds.add(entry.hold.id);
  }
  return [
    ...[...tables.holds.values()].filter(({ id, review }) => review && !holds.has(id)),
    ...[...tables.routes.values()].filter(
      ({ id, doubtful_start, doubtful_top }) => (doubtful_start || doubtful_top) && !routes.has(id),
    ),
  ];
}
