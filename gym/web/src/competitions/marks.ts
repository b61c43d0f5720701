/** What score events mean together, as the server has it (`competitions/ledger.py`); and what a tap means as an event. */

import type { ScoreWords } from "../outbox/store";
import type { Scored } from "./facts";

export interface Mark {
  tries: number;
  /** In which try it was held; 0: not. */
  zone: number;
  top: number;
}

export type Tap = "flash" | "try" | "zone" | "top";

export const NOTHING: Mark = { tries: 0, zone: 0, top: 0 };

/** Kinds of events that strike their target; an appeal and a decision leave it as it is. */
const STRIKING: ReadonlySet<string> = new Set(["attempt", "zone", "top", "void", "out"]);

/** The events that count: an event does unless one that does strikes it. */
export function counting<T extends Pick<Scored, "id" | "kind" | "target_id">>(events: readonly T[]): T[] {
  const strikers = new Map<string, T[]>();
  for (const event of events) {
    if (event.target_id && STRIKING.has(event.kind)) strikers.set(event.target_id, [...(strikers.get(event.target_id) ?? []), event]);
  }
  const counts = (event: T): boolean => !(strikers.get(event.id) ?? []).some(counts);
  return events.filter(counts);
}

/** What somebody has on a problem, of all events about it, in any order. */
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

/**
 * Kind and number of the try that a tap says.
 * `open`: the try in which the zone was held just now, and which has not ended; a top closes that one.
 */
export function said(tap: Tap, mark: Mark, open: number): Pick<ScoreWords, "kind" | "n"> {
  if (tap === "flash") return { kind: "top", n: 1 };
  if (tap === "top") return { kind: "top", n: open || mark.tries + 1 };
  return { kind: tap === "try" ? "attempt" : "zone", n: mark.tries + 1 };
}
