/** The filter of routes in the page's address: a link to a list shows the same list. */

import { ALL, HOLDS, LEANS, ONLY, ORDERS, type RouteFilter } from "./find";

const KEYS = Object.keys(ALL) as (keyof RouteFilter)[];
/** Values of the fields that allow only some. */
const VALUES: Partial<Record<keyof RouteFilter, readonly string[]>> = { lean: LEANS, only: ONLY, order: ORDERS, holds: HOLDS, fits: ["yes"] };
let lastGym = "";

/** Begin a page of a gym: with the filter of its address, else with that of the page before in the same gym. */
export function readAddress(filter: RouteFilter, gym: string): void {
  if (gym === lastGym && !location.search) return;
  const given = new URLSearchParams(location.search);
  const isGiven = KEYS.some((key) => given.has(key));
  if (isGiven || gym !== lastGym) Object.assign(filter, ALL);
  lastGym = gym;
  for (const key of KEYS) {
    const value = given.get(key);
    if (value && (VALUES[key]?.includes(value) ?? true)) Object.assign(filter, { [key]: value });
  }
}

/** Show the filter in the page's address. */
export function writeAddress(filter: RouteFilter): void {
  const search = new URLSearchParams(location.search);
  for (const key of KEYS) {
    if (filter[key] === ALL[key]) search.delete(key);
    else search.set(key, filter[key]);
  }
  const text = search.size ? `?${search}` : "";
  if (text !== location.search) history.replaceState(history.state, "", location.pathname + text + location.hash);
}

/** The address of a page with this filter. */
export function withFilter(address: string, filter: RouteFilter): string {
  const chosen = KEYS.filter((key) => filter[key] !== ALL[key]).map((key) => [key, filter[key]]);
  return chosen.length ? `${address}?${new URLSearchParams(chosen)}` : address;
}
