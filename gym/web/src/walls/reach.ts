/** The heights of climbers for which the movement model finds moves to the top. */

import { locale, t } from "../i18n.svelte";

export const metres = (value: number): string => value.toLocaleString(locale(), { minimumFractionDigits: 2 });

/** `reach` of a route, in metres from the shortest. */
export function reachText(reach: number[]): string {
  return reach.length ? `${metres(reach[0]!)}–${metres(reach.at(-1)!)} m` : t("route.reachNone");
}
