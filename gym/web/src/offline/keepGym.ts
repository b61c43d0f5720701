/** Sees to it that a gym opens without reception: what its pages ask for is asked for once, so that the service worker has it. */

import { answer, api, PREFIX } from "../api/client";
import { me } from "../session.svelte";
import { isCutOff, keeps } from "./reception.svelte";

const kept = new Set<string>();

/** Lists, and of each wall its routes, picture and first tier; not where the phone saves data. */
export async function keepGym(gym: string, isMember: boolean): Promise<void> {
  const connection = (navigator as unknown as { connection?: { saveData?: boolean } }).connection;
  if (kept.has(gym) || isCutOff() || connection?.saveData || !("serviceWorker" in navigator)) return;
  kept.add(gym);
  try {
    await fetchAll(gym, isMember);
  } catch {
    kept.delete(gym); // no reception: next time
  }
}

/** Until there is one who keeps answers. */
export async function keeper(): Promise<void> {
  await navigator.serviceWorker.ready;
  if (!keeps()) await new Promise((resolve) => navigator.serviceWorker.addEventListener("controllerchange", resolve, { once: true }));
}

async function fetchAll(gym: string, isMember: boolean): Promise<void> {
  await keeper();
  const params = { path: { gym } };
  const walls = await answer(api.GET("/api/v1/gyms/{gym}/walls", { params }));
  const lists = ["", "/routes", "/tallies", "/grade-systems", ...(isMember ? ["/logbook"] : [])];
  const asked = [...(me() ? [`${PREFIX}/me`] : []), ...lists.map((list) => `${PREFIX}/gyms/${gym}${list}`)];
  for (const wall of walls) {
    const base = `${PREFIX}/gyms/${gym}/walls/${wall.id}`;
    asked.push(base, `${base}/tallies`);
    if (!wall.published_scan_id) continue;
    asked.push(`${base}/published`, `${base}/picture?v=${wall.published_scan_id}`);
    asked.push(`${PREFIX}/gyms/${gym}/scans/${wall.published_scan_id}/files/page/first.glb`);
  }
  // One after the other: the page that is open goes before.
  for (const address of asked) {
    const came = await fetch(address, { priority: "low" } as RequestInit);
    await came.arrayBuffer();
  }
}
