/** Requests everything that the app needs offline, so that the service worker stores it. */

import { answer, api, PREFIX, ApiError } from "../api/client";
import { me } from "../session.svelte";
import { isPortal } from "./portal";
import { keeps } from "./reception.svelte";

const FIRST_WAIT_MS = 5000;
const MAX_WAIT_MS = 300_000;
/** Problems on a page of their list; the first page is kept. */
export const PROBLEMS_SHOWN = 50;
/** Lists of a gym that the app shows and keeps. */
export const LISTS_SHOWN = 200;

const kept = new Set<string>();

/** Keep lists and of each wall its routes, picture and first tier; not where the phone saves data. */
export function keepGym(gym: string, isMember: boolean): void {
  const connection = (navigator as unknown as { connection?: { saveData?: boolean } }).connection;
  const key = `${gym} ${isMember}`;
  if (kept.has(key) || connection?.saveData || !("serviceWorker" in navigator)) return;
  kept.add(key);
  keepTrying(() => fetchAll(gym, isMember));
}

/** Request until nothing fails, unless the server refuses: a busy server costs one attempt. Returns what ends it. */
export function keepTrying(request: () => Promise<void>): () => void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let isEnded = false;
  const attempt = async (wait: number): Promise<void> => {
    try {
      await controlled();
      if (!isEnded) await request();
    } catch (error) {
      const isRefused = error instanceof ApiError && error.status >= 400 && error.status < 429;
      if (!isEnded && !isRefused) timer = setTimeout(() => void attempt(Math.min(2 * wait, MAX_WAIT_MS)), wait);
    }
  };
  void attempt(FIRST_WAIT_MS);
  return () => {
    isEnded = true;
    clearTimeout(timer);
  };
}

/** Wait until a service worker controls this page. */
async function controlled(): Promise<void> {
  await navigator.serviceWorker.ready;
  if (!keeps()) await new Promise((resolve) => navigator.serviceWorker.addEventListener("controllerchange", resolve, { once: true }));
}

async function fetchAll(gym: string, isMember: boolean): Promise<void> {
  const params = { path: { gym } };
  const walls = await answer(api.GET("/api/v1/gyms/{gym}/walls", { params }));
  const lists = ["", "/routes", "/tallies", "/grade-systems", ...(isMember ? ["/logbook", `/lists?size=${LISTS_SHOWN}`] : [])];
  const addresses = [...(me() ? [`${PREFIX}/me`] : []), ...lists.map((list) => `${PREFIX}/gyms/${gym}${list}`)];
  for (const wall of walls) {
    const base = `${PREFIX}/gyms/${gym}/walls/${wall.id}`;
    addresses.push(base, `${base}/tallies`);
    if (!wall.published_scan_id) {
      addresses.push(`${base}/routes`);
      continue;
    }
    if (isMember) addresses.push(`${base}/problems?size=${PROBLEMS_SHOWN}`);
    addresses.push(`${base}/published`, `${base}/picture?v=${wall.published_scan_id}`);
    const page = `${PREFIX}/gyms/${gym}/scans/${wall.published_scan_id}/files/page`;
    addresses.push(`${page}/first.glb`, `${page}/labels.json`);
  }
  // One after the other: the page that is open goes before.
  for (const address of addresses) {
    const response = await fetch(address, { priority: "low" } as RequestInit);
    if (response.status >= 429 || isPortal(response)) throw new Error(`${address}: ${response.status}`);
    await response.arrayBuffer();
  }
}
