/** The marks that follow from score events, as on the server (`competitions/ledger.py`), and the event of a tap. */

import type { ScoreIn } from "../outbox/store";
import type { Scored } from "./facts";

export interface Mark {
  tries: number;
  /** The try that held it; 0: not held. */
  zone: number;
  top: number;
}

export type Tap = "flash" | "try" | "zone" | "top";

export const NOTHING: Mark = { tries: 0, zone: 0, top: 0 };

/** Kinds of events that strike their target; an appeal and a decision leave it as it is. */
const STRIKING: ReadonlySet<string> = new Set(["attempt", "zone", "top", "void", "out"]);

/** The events that count: those that no counting event strikes. */
export function counting<T extends Pick<Scored, "id" | "kind" | "target_id">>(events: readonly T[]): T[] {
  const strikers = new Map<string, T[]>();
  for (const event of events) {
    if (event.target_id && STRIKING.has(event.kind)) strikers.set(event.target_id, [...(strikers.get(event.target_id) ?? []), event]);
  }
  const counts = (event: T): boolean => !(strikers.get(event.id) ?? []).some(counts);
  return events.filter(counts);
}

/** A competitor's mark on a problem, from all events about it, in any order. */
export function markOf(events: readonly Scored[]): Mark {
  const mark = { ...NOTHING };
  const first = (now: number, n: number): number => (now ? Math.min(now, n) : n);
  for (const { kind, n } of counting(events)) {
    if (!n || (kind !== "attempt" && kind !== "zone" && kind !== "top")) continue;
    mark.tries = Math.max(mark.tries, n);
    if (kind !== "attempt") mark.zone = first(mark.zone, n);
    if (kind === "top") mark.top = first(mark.top, n);
  }
  return mark;
}

/** Kind and number of the try of a tap. `open`: the unfinished try that has just held the zone; a top ends it. */
export function entered(tap: Tap, mark: Mark, open: number): Pick<ScoreIn, "kind" | "n"> {
  if (tap === "flash") return { kind: "top", n: 1 };
  if (tap === "top") return { kind: "top", n: open || mark.tries + 1 };
  return { kind: tap === "try" ? "attempt" : "zone", n: mark.tries + 1 };
}
