/** Whether the server is heard, and since when not. Told by every answer (`api/client.ts`). */

const LOOK_MS = 15_000;

let since = $state.raw<Date | null>(navigator.onLine ? null : new Date());
let returns = $state(0);

/** Of when the last is that could be asked of the server; null while it answers. */
export function offlineSince(): Date | null {
  return since;
}

/** Whether there is no network at all: what is asked of the server now cannot come. */
export function isCutOff(): boolean {
  return since !== null && !navigator.onLine;
}

/** Grows each time the server is heard again: what is shown is then asked for anew. */
export function returned(): number {
  return returns;
}

export function heard(): void {
  if (!since) return;
  since = null;
  returns += 1;
}

/** `kept`: when what is shown instead was said. */
export function lost(kept: Date = new Date()): void {
  since = since && since < kept ? since : kept;
}

function look(): void {
  if (since && document.visibilityState === "visible") void fetch("/health", { cache: "no-store" }).then(heard, () => undefined);
}

setInterval(look, LOOK_MS);
window.addEventListener("online", look);
window.addEventListener("offline", () => lost());
document.addEventListener("visibilitychange", look);

/** Asks the service worker for what it keeps, and nobody else. */
export const KEPT = { cache: "only-if-cached", mode: "same-origin" } as const;

/** Whether there is one who keeps answers: without it a browser's own cache would answer, for whoever was signed in then. */
export function keeps(): boolean {
  return Boolean(navigator.serviceWorker?.controller);
}

/** What was kept was said to somebody else. */
export async function forgetAnswers(): Promise<void> {
  if ("caches" in window) await caches.delete("answers");
}
