/** The scan after a log of edits: the server's message (`walltopo.editing.messages`), for the page. */

import { tablesOf } from "../data/tables";
import type { Hold, Tables } from "../data/types";
import type { EditResult, HiddenPlace, Note } from "../data/wire";
import { Labels } from "../geometry/labels";

export interface Result {
  tables: Tables;
  /** Instances that are no holds, with the reason. */
  leftOut: Map<number, Hold>;
  /** Null: as the tiers came. */
  labels: Labels | null;
  hidden: readonly HiddenPlace[];
  notes: Note[];
}

/** `base`: what the page's own tables say of the whole wall. */
export function resultOf(raw: EditResult, base: Tables): Result {
  const { title, metric } = base;
  const kept = raw.holds.filter(({ left_out }) => !left_out);
  const others = raw.holds.filter(({ left_out }) => left_out);
  return {
    tables: tablesOf({ holds: kept, routes: raw.routes, title, metric }, title),
    leftOut: tablesOf({ holds: others }, "").holds,
    labels: new Labels(raw.surface),
    hidden: raw.hidden,
    notes: raw.notes,
  };
}
