/**
 * What a climber or judge has said and the server may not know yet, kept in this browser (IndexedDB): the wished state of
 * each ascent and opinion, and score events, which never change. So sending any of it again changes nothing.
 */

import { createStore, entries, promisifyRequest, update, type UseStore } from "idb-keyval";
import { nextEdit, type Edit } from "./edits";

export type Kind = "flash" | "top" | "zone" | "try" | "project";

export interface AscentWords {
  route_id: string;
  kind: Kind;
  tries: number;
  climbed_at: string;
  note: string;
}

export interface OpinionWords {
  grade: string;
  stars: number | null;
  wish: "" | "keep" | "renew";
  comment: string;
}

/** A score event as a device tells it (`competitions/`); `target_id`: the event that no longer counts because of it. */
export interface ScoreWords {
  entry_id: string;
  problem_id: string | null;
  kind: "attempt" | "zone" | "top" | "void" | "out" | "appeal" | "decision";
  n: number | null;
  target_id: string | null;
  text: string;
  device: string;
  number: number;
  made_at: string;
}

interface Common {
  /** Whose it is: nobody else's sign-in sends it. */
  person: string;
  gym: string;
  /** The route as it was called, or the score in words, for lists of what waits. */
  name: string;
}

export type Words = Common & (
  /** `known`: the server may have it already, from before. */
  | { what: "ascent"; id: string; route: string; body: AscentWords; takenBack: boolean; known: boolean }
  | { what: "opinion"; route: string; body: OpinionWords }
  | { what: "score"; id: string; competition: string; body: ScoreWords }
);

export type Item = Words & {
  /** When it was first said here, ms. */
  at: number;
  /** Grows with every change, so that an answer to an older one settles nothing. */
  version: number;
  /** For the server; what an older app kept has none. */
  edit?: Edit;
  /** How often it may have been sent. */
  sent: number;
  /** When the server took it, ms; it stays until the server shows it (`settle`). */
  done: number | null;
  /** Why the server will not have it. */
  refused: { status: number; message: string; hint: string } | null;
};

let store: UseStore | undefined;

function kept(): UseStore {
  return (store ??= createStore("walltopo-outbox", "items"));
}

export function keyOf(item: Words): string {
  return item.what === "opinion" ? `opinion/${item.person}/${item.route}` : `${item.what}/${item.id}`;
}

const channel = new BroadcastChannel("walltopo-outbox");
// A channel does not hear itself.
const here = new Set<() => void>();

function changed(): void {
  channel.postMessage("changed");
  for (const listener of here) listener();
}

/** Be told of every change, this tab's, another's or the service worker's. */
export function onChange(listener: () => void): void {
  here.add(listener);
  channel.addEventListener("message", listener);
}

/** All that is kept, the first said first. */
export async function all(): Promise<Item[]> {
  const rows = await entries<string, Item>(kept());
  return rows.map(([, item]) => item).sort((a, b) => a.at - b.at);
}

/** Keep what was said; of the same ascent or opinion only the last counts. */
export async function keep(words: Words): Promise<void> {
  const edit = await nextEdit();
  await update<Item>(keyOf(words), (old) => ({
    ...words,
    // One that is taken back and not here any more is at the server.
    ...(words.what === "ascent" ? { known: words.known || (old?.what === "ascent" ? old.known : words.takenBack) } : {}),
    at: old?.at ?? Date.now(),
    version: (old?.version ?? 0) + 1,
    edit,
    sent: old?.sent ?? 0,
    done: null,
    refused: null,
  }), kept());
  changed();
}

/** Change an item unless it has become another meanwhile; `null` lets it go. Whether it was changed. */
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

/** Let go what the server had taken before `asked`, the moment when it was asked for what it shows: that of which `shows` says so. */
export async function settle(asked: number, shows: (item: Item) => boolean): Promise<void> {
  for (const item of await all()) {
    if (item.done !== null && item.done < asked && shows(item)) await revise(item, () => null);
  }
}

/** Let go what never left; false where the server may have it already. */
export async function withdraw(item: Item): Promise<boolean> {
  let isHere = false;
  await revise(item, (now) => {
    isHere = now.sent === 0;
    return isHere ? null : now;
  });
  return isHere;
}
