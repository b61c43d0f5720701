/** The public version of a wall; shared by its page and its embedded form. */

import { answer, api, PREFIX, type Schemas } from "../api/client";
import { loadingKept } from "../lib/loaded.svelte";
import { KEPT } from "../offline/reception.svelte";
import { part } from "../routes";
import { expectViewer } from "./viewer";

/** `routes`: the current ones, whether a scan shows them or not. */
export type Published = { wall: Schemas["WallOut"]; version: Schemas["Version"] | null; routes: Schemas["RouteOut"][] };

export function publishedWall() {
  expectViewer();
  const path = $derived({ gym: part("gym"), wall: part("wall") });
  return loadingKept<Published>(async (how) => {
    const params = { path };
    const ask = () => answer(api.GET("/api/v1/gyms/{gym}/walls/{wall}/published", { params, ...how }));
    // Reading stored data is cheap, even if nothing is published.
    const kept = how === KEPT ? ask() : null;
    const wall = await answer(api.GET("/api/v1/gyms/{gym}/walls/{wall}", { params, ...how }));
    if (!wall.published_scan_id) {
      return { wall, version: null, routes: await answer(api.GET("/api/v1/gyms/{gym}/walls/{wall}/routes", { params, ...how })) };
    }
    const version = await (kept ?? ask());
    return { wall, version, routes: version.routes };
  });
}

/** The base address of a version's files. */
export function filesOf(gym: string, scan: string): string {
  return `${PREFIX}/gyms/${gym}/scans/${scan}/files`;
}
