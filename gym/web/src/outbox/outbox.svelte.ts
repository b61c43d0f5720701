/** What waits to be sent, as pages show it; sent when there is reception, and by the browser itself where it can (Background Sync). */

import { me } from "../session.svelte";
import { send } from "./send";
import { all, keep, onChange, revise, type Item, type Words } from "./store";

const FIRST_WAIT_MS = 2_000;
const LONGEST_WAIT_MS = 300_000;

let items = $state.raw<Item[]>([]);
let timer = 0;
let wait = FIRST_WAIT_MS;

/** Of who is signed in here. */
export function mine(): Item[] {
  const person = me()?.id;
  return items.filter((item) => item.person === person);
}

export function waiting(): Item[] {
  return mine().filter(({ done, refused }) => done === null && !refused);
}

export function refused(): Item[] {
  return mine().filter((item) => item.refused);
}

async function read(): Promise<void> {
  items = await all();
}

/** Send now; again later where that is of no use yet. */
export async function flush(): Promise<void> {
  clearTimeout(timer);
  const outcome = await send();
  if (outcome !== "later") {
    wait = FIRST_WAIT_MS;
    return;
  }
  // Phones that have lost reception together do not come back together.
  timer = window.setTimeout(() => void flush(), wait * (0.75 + Math.random() / 2));
  wait = Math.min(2 * wait, LONGEST_WAIT_MS);
}

interface SyncManager {
  register(tag: string): Promise<void>;
}

async function askForSync(): Promise<void> {
  const registration = await navigator.serviceWorker?.getRegistration();
  const sync = (registration as unknown as { sync?: SyncManager } | undefined)?.sync;
  // Where it is not allowed the app sends when it is open.
  await sync?.register("outbox").catch(() => undefined);
}

/** Keep what was said, and send it. Resolved as soon as it is safe here, and pages know of it. */
export async function say(words: Words): Promise<void> {
  await keep(words);
  await read();
  void navigator.storage?.persist?.();
  void askForSync();
  void flush();
}

export async function tryAgain(item: Item): Promise<void> {
  await revise(item, (now) => ({ ...now, refused: null }));
  await flush();
}

export async function discard(item: Item): Promise<void> {
  await revise(item, () => null);
}

export function begin(): void {
  onChange(() => void read());
  void read().then(flush);
  window.addEventListener("online", () => void flush());
  document.addEventListener("visibilitychange", () => {
    if (document.visibilityState === "visible") void flush();
  });
}
