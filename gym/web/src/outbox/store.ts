/**
 * Entries of a climber or judge that the server may not have yet, stored in this browser (IndexedDB): the wanted state
 * of each ascent, opinion, problem and list, and score events, hold reports and marks of inspections, which never change.
 * So sending any of it again changes nothing.
 */

import { createStore, entries, promisifyRequest, update, type UseStore } from "idb-keyval";
import { nextEdit, type Edit } from "./edits";
import type { Discipline, Kind } from "./kinds";

export interface AscentIn {
  route_id: string;
  kind: Kind;
  tries: number;
  /** Missing in items of older app versions: as the route is usually climbed. */
  discipline?: Discipline;
  /** Number of the highest clip, of a high point alone. */
  high_point?: number | null;
  climbed_at: string;
  note: string;
}

export interface OpinionIn {
  grade: string;
  stars: number | null;
  wish: "" | "keep" | "renew";
  comment: string;
}

/** A report of a hold in the version `scan_id`, or of a route without a hold. */
export interface HoldReportIn {
  wall_id: string;
  scan_id: string;
  hold: number | null;
  route_id: string | null;
  kind: "spins" | "broken" | "sharp" | "dirty";
  note: string;
}

/** A problem of one's own; the ids of its holds are those of the version `scan_id`. */
export interface ProblemIn {
  wall_id: string;
  scan_id: string;
  holds: { hold: number; use: "start" | "hand" | "foot" | "top" }[];
  name: string;
  grade_system_id: string | null;
  grade: string;
  share: "private" | "link" | "gym";
  matching: boolean;
  note: string;
  remix_of: string | null;
}

/** A list of one's own; `items`: ids of routes and problems. */
export interface ListIn {
  name: string;
  note: string;
  share: "private" | "link" | "gym";
  circuit: boolean;
  items: string[];
}

/** A score event as a device sends it (`competitions/`); `target_id`: the event that it strikes. */
export interface ScoreIn {
  entry_id: string;
  problem_id: string | null;
  kind: "attempt" | "zone" | "top" | "high" | "void" | "out" | "appeal" | "decision";
  n: number | null;
  /** A high point on a route, and the climbing time to it or to the top. */
  hold?: number | null;
  plus?: boolean;
  seconds?: number | null;
  target_id: string | null;
  text: string;
  device: string;
  number: number;
  made_at: string;
}

/** A mark of an inspection: of an item of its checklist, or of a hold. */
export interface InspectionMarkIn {
  wall_id: string;
  item: number | null;
  hold: number | null;
  mark: "fine" | "defect" | "unchecked" | "tightened" | "washed" | "removed";
  note: string;
}

/** An ascent of a list that is saved at once. */
export interface ManyRow {
  id: string;
  /** The route's name. */
  name: string;
  body: AscentIn;
}

/** The owner of what is logged on a device without an account. It stays here until an account takes it over. */
export const GUEST = "guest";

/** The judge's link by which an item goes; undefined for an item of an account. */
export function linkOf(item: Words): string | undefined {
  return item.what === "score" ? item.link : undefined;
}

interface Common {
  /** The owner: another account never sends it. Empty for what goes by a judge's link. */
  person: string;
  gym: string;
  /** The name of the route, or the score in words, for lists of waiting items. */
  name: string;
}

export type Words = Common & (
  /** `known`: the server may have it already, from before. */
  | { what: "ascent"; id: string; route: string; body: AscentIn; takenBack: boolean; known: boolean }
  | { what: "ascents"; id: string; rows: ManyRow[]; takenBack: boolean; known: boolean }
  | { what: "opinion"; route: string; body: OpinionIn }
  | { what: "hold"; id: string; body: HoldReportIn }
  | { what: "problem"; id: string; body: ProblemIn; takenBack: boolean; known: boolean }
  | { what: "list"; id: string; body: ListIn; takenBack: boolean; known: boolean }
  | { what: "climbed"; problem: string; body: { climbed_at: string | null } }
  /** `link`: the judge's link by which it goes, instead of an account. */
  | { what: "score"; id: string; competition: string; body: ScoreIn; link?: string }
  | { what: "inspection"; id: string; inspection: string; body: InspectionMarkIn; photo: Blob | null }
);

export type Item = Words & {
  /** Time of the first entry, ms. */
  at: number;
  /** Grows with every change, so that a response to an older version settles nothing. */
  version: number;
  /** For the server; items of older app versions have none. */
  edit?: Edit;
  /** Maximum number of times that it may have been sent. */
  sent: number;
  /** Time of its acceptance, ms; it stays until the server shows it (`settle`). */
  done: number | null;
  /** Why the server refused it, in English; `body` is its answer, with codes for other languages. */
  refused: { status: number; message: string; hint: string; body?: object } | null;
};

let store: UseStore | undefined;

function kept(): UseStore {
  return (store ??= createStore("walltopo-outbox", "items"));
}

export function keyOf(item: Words): string {
  if (item.what === "opinion") return `opinion/${item.person}/${item.route}`;
  return item.what === "climbed" ? `climbed/${item.person}/${item.problem}` : `${item.what}/${item.id}`;
}

/** Changes when the server has accepted one of these items. */
export function acceptedKey(items: Item[]): string {
  return items.filter(({ done }) => done !== null).map((item) => `${keyOf(item)} ${item.version}`).join();
}

const channel = new BroadcastChannel("walltopo-outbox");
// A channel does not hear itself.
const here = new Set<() => void>();

function changed(): void {
  channel.postMessage("changed");
  for (const listener of here) listener();
}

/** Subscribe to every change, by this tab, another tab or the service worker. */
export function onChange(listener: () => void): void {
  here.add(listener);
  channel.addEventListener("message", listener);
}

/** All items in order of entry. */
export async function all(): Promise<Item[]> {
  const rows = await entries<string, Item>(kept());
  return rows.map(([, item]) => item).sort((a, b) => a.at - b.at);
}

/** Store an entry; only the latest one of an ascent or opinion counts. */
export async function keep(words: Words): Promise<void> {
  const edit = await nextEdit();
  await update<Item>(keyOf(words), (old) => ({
    ...words,
    // A withdrawn item that is not here any more is on the server.
    ...("known" in words ? { known: words.known || (old && "known" in old ? old.known : words.takenBack) } : {}),
    at: old?.at ?? Date.now(),
    version: (old?.version ?? 0) + 1,
    edit,
    sent: old?.sent ?? 0,
    done: null,
    refused: null,
  }), kept());
  changed();
}

/** Change an item unless it was replaced meanwhile; `null` deletes it. Returns whether it was changed. */
export async function revise(item: Item, change: (now: Item) => Item | null): Promise<boolean> {
  let isSame = false;
  await kept()("readwrite", (rows) => {
    const read = rows.get(keyOf(item)) as IDBRequest<Item | undefined>;
    read.onsuccess = () => {
      if (read.result?.version !== item.version) return;
      isSame = true;
      const next = change(read.result);
      if (next) rows.put(next, keyOf(item));
      else rows.delete(keyOf(item));
    };
    return promisifyRequest(rows.transaction);
  });
  changed();
  return isSame;
}

/**
 * Delete accepted items of which `shows` says that the server shows them, if they were accepted before `requested`, the
 * time of that request.
 */
export async function settle(requested: number, shows: (item: Item) => boolean): Promise<void> {
  for (const item of await all()) {
    if (item.done !== null && item.done < requested && shows(item)) await revise(item, () => null);
  }
}

/** Delete an item that never left; false if the server may have it already. */
export async function withdraw(item: Item): Promise<boolean> {
  let isHere = false;
  await revise(item, (now) => {
    isHere = now.sent === 0;
    return isHere ? null : now;
  });
  return isHere;
}
