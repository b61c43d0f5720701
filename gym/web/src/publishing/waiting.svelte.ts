import type { Loaded } from "../lib/loaded.svelte";

const FIRST_WAIT_MS = 1500;
const LONGEST_WAIT_MS = 30_000;

/** Load a result again while the server computes it, ever less often. Call it while a component is initialised. */
export function reloadWhileWaiting(result: Loaded<{ state: "waiting" | "ready" } | null>): void {
  let wait = FIRST_WAIT_MS;
  $effect(() => {
    if (result.data?.state !== "waiting") return;
    const later = setTimeout(() => void result.load(), wait);
    wait = Math.min(1.5 * wait, LONGEST_WAIT_MS);
    return () => clearTimeout(later);
  });
}
