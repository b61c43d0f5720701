/** The heights of climbers for which the movement model finds moves to the top, and their longest reach. */

import type { Schemas } from "../api/client";
import { t } from "../i18n.svelte";
import { metres } from "../lib/units.svelte";

// As `HEIGHTS` of the movement model: metres, from the shortest to the tallest climber and their distance.
const [SHORTEST, TALLEST, STEP] = [1.2, 1.95, 0.15];

/** `reach` of a route: heights in metres, from the shortest. */
export function reachText(reach: number[]): string {
  return reach.length ? `${metres(reach[0]!)} – ${metres(reach.at(-1)!)}` : t("route.reachNone");
}

/** The longest reach in metres on the way of a climber of this height to the top; null: they do not reach it, or it is unknown. */
export function longestReach({ reach, longest_reach }: Schemas["RouteOut"], height: number): number | null {
  const own = Math.min(TALLEST, Math.max(SHORTEST, height));
  const place = (reach ?? []).findIndex((one) => Math.abs(one - own) <= STEP / 2 + 1e-6);
  return place < 0 ? null : (longest_reach?.[place] ?? null);
}
