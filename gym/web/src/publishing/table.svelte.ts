/** The table that a setter confirms: each route of the new scan, its identity and its facts. */

import type { Schemas } from "../api/client";
import type { Route } from "../walls/find";

export type Line = Schemas["DraftLine"];

export interface Row {
  number: number;
  /** Colour and holds as the scan found them, and how it compares. */
  line: Line;
  /** Id of the existing route; empty: a new one. */
  same: string;
  /** Whether it is a route at all. */
  taken: boolean;
  name: string;
  /** `system|label`; empty: none. */
  grade: string;
  setter: string;
  tags: string;
  strips: string;
  /** Id of the rope's line; empty: a boulder. */
  rope: string;
  /** The facts of the existing route when it was chosen or last read. */
  known: Words;
}

const FIELDS = ["name", "grade", "setter", "tags", "strips", "rope"] as const;
type Words = Record<(typeof FIELDS)[number], string>;

const NOTHING: Words = { name: "", grade: "", setter: "", tags: "", strips: "", rope: "" };

function wordsOf(route: Route | undefined): Words {
  if (!route) return { ...NOTHING };
  return {
    name: route.name,
    grade: route.grade ? `${route.grade_system_id}|${route.grade}` : "",
    setter: route.setter,
    tags: route.tags.join(", "),
    strips: route.strip_on ?? "",
    rope: route.line?.id ?? "",
  };
}

/** A row as an existing route (none: a new one): its facts are filled in, unless others were typed. */
export function identified(row: Row, route: Route | undefined): Row {
  const [before, known] = [row.known ?? NOTHING, wordsOf(route)];
  const filled = FIELDS.filter((field) => row[field] === before[field]).map((field) => [field, known[field]] as const);
  return { ...row, ...Object.fromEntries(filled), same: route?.id ?? "", known };
}

/** The rows as the scan proposes them; earlier input that still fits is restored. */
export function rowsOf(lines: Line[], hanging: Route[], typed: Row[]): Row[] {
  const ids = new Set(hanging.map(({ id }) => id));
  return lines.flatMap((line) => {
    if (line.number === null) return [];
    const number = line.number;
    const before = typed.find((row) => row.number === number);
    // A forerun may have changed the route's grade meanwhile.
    if (before && (before.same === "" || ids.has(before.same))) {
      return [identified({ ...before, rope: before.rope ?? "", line }, hanging.find(({ id }) => id === before.same))];
    }
    const route = hanging.find(({ id }) => id === line.route_id);
    const words = { ...wordsOf(route), ...(route ? {} : { rope: line.line_id ?? "" }) };
    return [{ number, line, same: line.route_id ?? "", taken: true, ...words, known: words }];
  });
}

/** The current routes that no row claims: publishing strips them, except those that were added by hand. */
export function strippedBy(rows: Row[], hanging: Route[]): Route[] {
  const kept = new Set(rows.filter(({ taken }) => taken).map(({ same }) => same));
  return hanging.filter(({ id, number }) => number != null && !kept.has(id));
}

/** Routes that two rows claim to be. */
export function claimedTwice(rows: Row[]): Set<string> {
  const claimed = rows.filter(({ taken, same }) => taken && same).map(({ same }) => same);
  return new Set(claimed.filter((id, at) => claimed.indexOf(id) !== at));
}

/**
 * Routes that were added by hand and are probably rows of the scan, by the row's number. A row fits a route of its colour or
 * name, unless a typed name or grade says otherwise; a fit counts if neither of the two fits another one.
 */
export function suggestions(rows: Row[], hanging: Route[]): Map<number, Route> {
  const claimed = new Set(rows.filter(({ taken }) => taken).map(({ same }) => same));
  const free = hanging.filter(({ id, number }) => number == null && !claimed.has(id));
  const open = rows.filter(({ taken, same }) => taken && !same);
  const fits = new Map(free.map((route) => [route, open.filter((row) => isFit(row, route))]));
  const found = new Map<number, Route>();
  for (const [route, those] of fits) {
    const [row] = those;
    const isOnly = row && those.length === 1 && [...fits.values()].filter((others) => others.includes(row)).length === 1;
    if (isOnly) found.set(row.number, route);
  }
  return found;
}

function isFit(row: Row, route: Route): boolean {
  const [typed, name] = [row.name, route.name].map((text) => text.trim().toLocaleLowerCase());
  if ((typed && typed !== name) || (row.grade && row.grade !== wordsOf(route).grade)) return false;
  return Boolean(typed) || row.line.colour === route.colour;
}

function factsOf(row: Row) {
  const [system, label] = row.grade.split("|");
  return {
    name: row.name,
    grade_system_id: system || null,
    grade: label ?? "",
    setter: row.setter,
    tags: row.tags.split(",").map((tag) => tag.trim()).filter(Boolean),
    strip_on: row.strips || null,
    line_id: row.rope || null,
  };
}

/** The rows as the server expects them. */
export function entriesOf(rows: Row[]): Schemas["RouteEntry"][] {
  return rows.filter(({ taken }) => taken).map((row) => ({ number: row.number, route_id: row.same || null, ...factsOf(row) }));
}

/** A row as a route without a scan. */
export function handRouteOf(row: Row, id: string): Schemas["NewRoute"] {
  return { id, colour: row.line.colour, ...factsOf(row) };
}

const KEPT = "walltopo-review-";

/** Typed text outlives a closed tab. */
export const typed = {
  keep: (scan: string, rows: Row[]): void => localStorage.setItem(KEPT + scan, JSON.stringify(rows)),
  get: (scan: string): Row[] => JSON.parse(localStorage.getItem(KEPT + scan) ?? "[]") as Row[],
  drop: (scan: string): void => localStorage.removeItem(KEPT + scan),
};
