/** What everybody sees of a wall; shared by its page and its embedded form. */

import { answer, api, PREFIX, type Schemas } from "../api/client";
import { loadingKept } from "../lib/loaded.svelte";
import { KEPT } from "../offline/reception.svelte";
import { part } from "../routes";
import { expectViewer } from "./viewer";

export type Published = { wall: Schemas["WallFacts"]; version: Schemas["Version"] | null };

export function publishedWall() {
  expectViewer();
  const path = $derived({ gym: part("gym"), wall: part("wall") });
  return loadingKept<Published>(async (how) => {
    const params = { path };
    const ask = () => answer(api.GET("/api/v1/gyms/{gym}/walls/{wall}/published", { params, ...how }));
    // Asking for what is kept costs nobody anything, where nothing is published neither.
    const kept = how === KEPT ? ask() : null;
    const wall = await answer(api.GET("/api/v1/gyms/{gym}/walls/{wall}", { params, ...how }));
    if (!wall.published_scan_id) return { wall, version: null };
    return { wall, version: await (kept ?? ask()) };
  });
}

/** Where the files of a version lie. */
export function filesOf(gym: string, scan: string): string {
  return `${PREFIX}/gyms/${gym}/scans/${scan}/files`;
}
