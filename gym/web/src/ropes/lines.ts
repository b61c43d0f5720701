/** The ropes' lines of a wall; none on a boulder wall. */

import { answer, api, type Schemas } from "../api/client";
import type { How } from "../lib/loaded.svelte";
import type { Point } from "../walls/viewer";

export type RopeLine = Omit<Schemas["RopeLineOut"], "points"> & { points: Point[] };

export async function ropeLines({ gym, wall }: { gym: string; wall: string }, how: How = {}): Promise<RopeLine[]> {
  return (await answer(api.GET("/api/v1/gyms/{gym}/walls/{wall}/lines", { params: { path: { gym, wall } }, ...how }))) as RopeLine[];
}
