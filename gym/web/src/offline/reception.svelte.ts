/** Whether the server can be reached, and since when not. Each response updates it (`api/client.ts`). */

import { isPortal } from "./portal";

const LOOK_MS = 15_000;

let since = $state.raw<Date | null>(navigator.onLine ? null : new Date());
let returns = $state(0);
let portal = $state(false);

/** Time of the last response; null while the server responds. */
export function offlineSince(): Date | null {
  return since;
}

/** Whether this network answers with its own page, because it wants a sign-in first. */
export function isHeldByPortal(): boolean {
  return portal;
}

/** Whether there is no network at all, so that requests cannot succeed. */
export function isCutOff(): boolean {
  return since !== null && !navigator.onLine;
}

/** Grows each time the server is reachable again; shown data is then reloaded. */
export function returned(): number {
  return returns;
}

export function heard(): void {
  if (!since) return;
  since = null;
  portal = false;
  returns += 1;
}

/** `kept`: the age of the stored data that is shown instead. */
export function lost(kept: Date = new Date()): void {
  if (!since) void probe();
  since = since && since < kept ? since : kept;
}

/** Ask the server itself, past the service worker. */
const ask = (): Promise<Response> => fetch("/health", { cache: "no-store" });

/** Find out whether the server can be reached after something was not sent; `look` alone says that it can be again. */
export async function probe(): Promise<void> {
  const response = await ask().catch(() => null);
  portal = response !== null && isPortal(response);
  if (portal || !response) since ??= new Date();
}

function look(): void {
  if (!since || document.visibilityState !== "visible") return;
  void ask().then((response) => (isPortal(response) ? (portal = true) : heard()), () => (portal = false));
}

setInterval(look, LOOK_MS);
window.addEventListener("online", look);
window.addEventListener("offline", () => lost());
window.addEventListener("focus", look);
window.addEventListener("pageshow", look);
document.addEventListener("visibilitychange", look);

/** Requests stored data from the service worker only. */
export const KEPT = { cache: "only-if-cached", mode: "same-origin" } as const;

/** Whether a service worker stores responses: without it, the browser's own cache would answer, for any earlier account. */
export function keeps(): boolean {
  return Boolean(navigator.serviceWorker?.controller);
}

/** Deletes stored data that only the account before may see: answers, and files of private gyms. */
export async function forgetPrivate(): Promise<void> {
  if (!("caches" in window)) return;
  await caches.delete("answers");
  const files = await caches.open("files");
  for (const key of await files.keys()) {
    const kept = await files.match(key);
    if (!/\bpublic\b/.test(kept?.headers.get("cache-control") ?? "")) await files.delete(key);
  }
}
