/** What a climber has said and the server may not know yet, kept in this browser (IndexedDB): the wished state of each ascent and opinion, not a list of steps, so that sending it again changes nothing. */

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

interface Common {
  /** Whose it is: nobody else's sign-in sends it. */
  person: string;
  gym: string;
  route: string;
  /** The route as it was called, for lists of what waits. */
  name: string;
}

export type Words = Common & (
  /** `known`: the server may have it already, from before. */
  | { what: "ascent"; id: string; body: AscentWords; takenBack: boolean; known: boolean }
  | { what: "opinion"; body: OpinionWords }
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
  return item.what === "ascent" ? `ascent/${item.id}` : `opinion/${item.person}/${item.route}`;
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

/** Let go what the server had taken before `asked`, the moment when it was asked for what it shows. */
export async function settle(gym: string, person: string, asked: number): Promise<void> {
  for (const item of await all()) {
    const over = item.gym === gym && item.person === person && item.done !== null && item.done < asked;
    if (over) await revise(item, () => null);
  }
}
