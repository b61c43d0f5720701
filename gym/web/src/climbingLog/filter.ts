/** Filters of the log, and groups of its entries. */

import type { Schemas } from "../api/client";
import { TOPS } from "../outbox/kinds";

export type LogEntry = Schemas["LogEntry"];
export type LogFilter = { words: string; location: string; grade: string; colour: string; steepness: string; kind: string; discipline: string };

export const ALL: LogFilter = { words: "", location: "", grade: "", colour: "", steepness: "", kind: "", discipline: "" };

export function isAll(filter: LogFilter): boolean {
  return Object.values(filter).every((value) => value === "");
}

/** The climbs of one day in one location. */
export interface Visit {
  day: string;
  location: string;
  tops: number;
  entries: LogEntry[];
}

/** Entries in the order given, grouped by day and location. */
export function visits(entries: LogEntry[]): Visit[] {
  const groups = new Map<string, LogEntry[]>();
  for (const entry of entries) {
    const key = `${entry.day}\n${entry.location}`;
    groups.set(key, [...(groups.get(key) ?? []), entry]);
  }
  return [...groups.values()].map((group) => ({
    day: group[0]!.day,
    location: group[0]!.location,
    tops: group.filter(({ kind }) => (TOPS as readonly string[]).includes(kind)).length,
    entries: group,
  }));
}
