/** The waiting items for pages; sent when there is reception, and by the browser itself if it supports Background Sync. */

import { probe, returned } from "../offline/reception.svelte";
import { me } from "../session.svelte";
import { send } from "./send";
import { all, GUEST, keep, linkOf, onChange, revise, type Item, type Words } from "./store";

const FIRST_WAIT_MS = 2_000;
const LONGEST_WAIT_MS = 300_000;

let items = $state.raw<Item[]>([]);
let timer = 0;
let wait = FIRST_WAIT_MS;

/** The owner of new items: the signed-in person, or this device's guest. */
export function author(): string {
  return me()?.id ?? GUEST;
}

/** Items of the signed-in person, or else of this device's guest, and those that go by judges' links. */
export function mine(): Item[] {
  return items.filter((item) => item.person === author() || linkOf(item));
}

/** Items of this device without an account. */
export function ofGuest(): Item[] {
  return items.filter((item) => item.person === GUEST);
}

export function waiting(): Item[] {
  return mine().filter(({ person, done, refused }) => person !== GUEST && done === null && !refused);
}

export function refused(): Item[] {
  return mine().filter((item) => item.refused);
}

async function read(): Promise<void> {
  items = await all();
}

/** Send now; retry later if that fails. */
export async function flush(): Promise<void> {
  clearTimeout(timer);
  const outcome = await send();
  if (outcome !== "later") {
    wait = FIRST_WAIT_MS;
    return;
  }
  void probe();
  // A random delay: phones that lost reception together must not all return at once.
  timer = window.setTimeout(() => void flush(), wait * (0.75 + Math.random() / 2));
  wait = Math.min(2 * wait, LONGEST_WAIT_MS);
}

interface SyncManager {
  register(tag: string): Promise<void>;
}

async function askForSync(): Promise<void> {
  const registration = await navigator.serviceWorker?.getRegistration();
  const sync = (registration as unknown as { sync?: SyncManager } | undefined)?.sync;
  // Without permission, the app sends while it is open.
  await sync?.register("outbox").catch(() => undefined);
}

/** Store an item and send it. Resolves once it is stored and pages show it. */
export async function say(words: Words): Promise<void> {
  await keep(words);
  if (words.person === GUEST) await dropTakenBack();
  await read();
  void navigator.storage?.persist?.();
  void askForSync();
  void flush();
}

/** No server needs to hear that a guest took something back. */
async function dropTakenBack(): Promise<void> {
  for (const item of await all()) {
    if (item.person === GUEST && "takenBack" in item && item.takenBack) await discard(item);
  }
}

/** Hand over what a guest logged to the signed-in person, and send it. */
export async function takeOver(): Promise<void> {
  const person = me()?.id;
  if (!person) return;
  for (const item of ofGuest()) await revise(item, (now) => ({ ...now, person }));
  void askForSync();
  await flush();
}

export async function tryAgain(item: Item): Promise<void> {
  await revise(item, (now) => ({ ...now, refused: null }));
  await flush();
}

export async function sendWithoutPhoto(item: Item): Promise<void> {
  await revise(item, (now) => ("photo" in now ? { ...now, photo: null, refused: null } : now));
  await flush();
}

export async function discard(item: Item): Promise<void> {
  await revise(item, () => null);
}

export function begin(): void {
  onChange(() => void read());
  void read().then(flush);
  // Most browsers have no Background Sync.
  for (const event of ["online", "focus", "pageshow"]) window.addEventListener(event, () => void flush());
  $effect.root(() => {
    $effect(() => {
      if (returned() > 0) void flush();
    });
  });
  document.addEventListener("visibilitychange", () => {
    if (document.visibilityState === "visible") void flush();
  });
}
