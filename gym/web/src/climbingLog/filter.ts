/** Filters of the log, and groups of its entries. */

import type { Schemas } from "../api/client";

export type LogEntry = Schemas["LogEntry"];
export type LogFilter = { words: string; location: string; grade: string; colour: string; steepness: string; kind: string };

export const ALL: LogFilter = { words: "", location: "", grade: "", colour: "", steepness: "", kind: "" };

export const KINDS = ["onsight", "flash", "top", "repeat", "zone", "try", "project"] as const;
export type LogKind = (typeof KINDS)[number];

const TOPS: readonly string[] = ["onsight", "flash", "top", "repeat"];

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
    tops: group.filter(({ kind }) => TOPS.includes(kind)).length,
    entries: group,
  }));
}
