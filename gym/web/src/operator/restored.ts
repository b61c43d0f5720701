/** Waiting for a server that stops, is replaced by a backup, and serves again. */

const PAUSE_MS = 1000;
/** A server that was never seen to be away has restored faster than it was looked at. */
const PATIENCE = 30;

const pause = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
const serves = (): Promise<boolean> => fetch("/health", { cache: "no-store" }).then(({ ok }) => ok, () => false);

/** Resolves once the server was away and serves again. */
export async function servesAgain(): Promise<void> {
  let wasAway = false;
  for (let looks = 0; ; looks++) {
    await pause();
    const isThere = await serves();
    if (isThere && (wasAway || looks >= PATIENCE)) return;
    wasAway ||= !isThere;
  }
}
