/** The heights of climbers that reach the top of each route of a scan, before it is published. */

import { answer, api, type Schemas } from "../api/client";
import { loading, type Loaded } from "../lib/loaded.svelte";
import { reloadWhileWaiting } from "./waiting.svelte";

export type Reached = Schemas["RouteReach"]["reached"][number];

export class Reach {
  private readonly result: Loaded<Schemas["ScanReach"] | null>;

  /** Create it while a component is initialised; `ready`: whether there is a draft. */
  constructor(path: () => { gym: string; scan: string }, ready: () => boolean) {
    this.result = loading(async () =>
      ready() ? answer(api.GET("/api/v1/gyms/{gym}/scans/{scan}/reach", { params: { path: path() } })) : null,
    );
    reloadWhileWaiting(this.result);
  }

  /** Share by which arms were taken longer and shorter than usual. */
  get arms(): number {
    return this.result.data?.arms ?? 0;
  }

  /** Each height with whether it reaches the top of a route; empty while it is computed. */
  of(number: number): { height: number; reached: Reached }[] {
    const result = this.result.data;
    const reached = result?.routes.find((row) => row.number === number)?.reached ?? [];
    return reached.map((one, at) => ({ height: result!.heights[at]!, reached: one }));
  }
}
