/** The marks that follow from score events, as on the server (`competitions/ledger.py`), and the event of a tap. */

import type { ScoreIn } from "../outbox/store";
import type { Scored } from "./facts";

export interface Mark {
  tries: number;
  /** The try that held it; 0: not held. */
  zone: number;
  top: number;
  /** The best high point on a route below the top, and the try that reached it; 0 without one. */
  hold: number;
  plus: boolean;
  highTry: number;
  /** Climbing time to the high point or the top; null: unknown. */
  seconds: number | null;
}

export type High = Pick<Mark, "hold" | "plus"> & { top: boolean };

export type Tap = "flash" | "try" | "zone" | "top";

export const NOTHING: Mark = { tries: 0, zone: 0, top: 0, hold: 0, plus: false, highTry: 0, seconds: null };

/** The server refuses a longer climbing time. */
const MAX_SECONDS = 3600;

const SCORED: ReadonlySet<string> = new Set(["attempt", "zone", "top", "high"]);

/** Kinds of events that strike their target; an appeal and a decision leave it as it is. */
const STRIKING: ReadonlySet<string> = new Set(["attempt", "zone", "top", "high", "void", "out"]);

/** The events that count: those that no counting event strikes. */
export function counting<T extends Pick<Scored, "id" | "kind" | "target_id">>(events: readonly T[]): T[] {
  const strikers = new Map<string, T[]>();
  for (const event of events) {
    if (event.target_id && STRIKING.has(event.kind)) strikers.set(event.target_id, [...(strikers.get(event.target_id) ?? []), event]);
  }
  const counts = (event: T): boolean => !(strikers.get(event.id) ?? []).some(counts);
  return events.filter(counts);
}

/** A competitor's mark on a problem, from all events about it, in any order; attempts beyond the limit do not count. */
export function markOf(events: readonly Scored[], limit: number | null = null): Mark {
  const mark = { ...NOTHING };
  const first = (now: number, n: number): number => (now ? Math.min(now, n) : n);
  const scored = counting(events).filter(({ kind, n }) => n && n <= (limit ?? n) && SCORED.has(kind));
  for (const { kind, n } of scored) {
    mark.tries = Math.max(mark.tries, n!);
    if (kind === "zone" || kind === "top") mark.zone = first(mark.zone, n!);
    if (kind === "top") mark.top = first(mark.top, n!);
  }
  return { ...mark, ...bestHigh(scored) };
}

/** The best high point of events, its first try and its shortest time; a top has no hold here. */
function bestHigh(scored: readonly Scored[]): Partial<Mark> {
  const highest = Math.max(0, ...scored.map(height));
  const best = highest ? scored.filter((event) => height(event) === highest) : [];
  const times = best.flatMap(({ seconds }) => seconds ?? []);
  const seconds = times.length ? Math.min(...times) : null;
  const [one] = best;
  if (!one || one.kind === "top") return { seconds };
  return { hold: one.hold ?? 0, plus: Boolean(one.plus), highTry: Math.min(...best.map(({ n }) => n!)), seconds };
}

function height({ kind, hold, plus }: Scored): number {
  if (kind === "top") return Infinity;
  return kind === "high" ? 2 * (hold ?? 0) + (plus ? 1 : 0) + 1 : 0;
}

/** A high point as judges write it: 34, 34+ or TOP. */
export function highText({ hold, plus, top }: High): string {
  return top ? "TOP" : `${hold}${plus ? "+" : ""}`;
}

/** The high point of an event; null if it has none. */
export function highOf({ kind, hold, plus }: Pick<Scored, "kind" | "hold" | "plus">): High | null {
  if (kind !== "high" && kind !== "top") return null;
  return { hold: hold ?? 0, plus: Boolean(plus), top: kind === "top" };
}

/** A climbing time as minutes and seconds. */
export function timeText(seconds: number): string {
  return `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}

/** Seconds of a time as people write it: 4:12, or 252; null if it is none. */
export function timeOf(text: string): number | null {
  const found = /^(?:(\d{1,2}):([0-5]\d)|(\d{1,4}))$/.exec(text.trim());
  if (!found) return null;
  const seconds = found[3] === undefined ? Number(found[1]) * 60 + Number(found[2]) : Number(found[3]);
  return seconds > 0 && seconds <= MAX_SECONDS ? seconds : null;
}

/** Kind and number of the try of a tap. `open`: the unfinished try that has just held the zone; a top ends it. */
export function entered(tap: Tap, mark: Mark, open: number): Pick<ScoreIn, "kind" | "n"> {
  if (tap === "flash") return { kind: "top", n: 1 };
  if (tap === "top") return { kind: "top", n: open || mark.tries + 1 };
  return { kind: tap === "try" ? "attempt" : "zone", n: mark.tries + 1 };
}
