/** The filter of routes in the page's address: a link to a list shows the same list. */

import { ALL, HOLDS, LEANS, ONLY, ORDERS, type RouteFilter } from "./find";

const KEYS = Object.keys(ALL) as (keyof RouteFilter)[];
/** Values of the fields that allow only some. */
const VALUES: Partial<Record<keyof RouteFilter, readonly string[]>> = { lean: LEANS, only: ONLY, order: ORDERS, holds: HOLDS, fits: ["yes"] };
let lastGym = "";

/** Keep the filter of a page and its address the same. `path`: it changes with the page's address. */
export function keepInAddress(filter: RouteFilter, gym: () => string, path: () => string): void {
  $effect.pre(() => readAddress(filter, gym()));
  $effect(() => {
    void [path(), { ...filter }];
    writeAddress(filter);
  });
}

/** Begin a page of a gym: with the filter of its address, else with that of the page before in the same gym. */
function readAddress(filter: RouteFilter, gym: string): void {
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
function writeAddress(filter: RouteFilter): void {
  const address = withFilter(location.pathname + location.search, filter);
  if (address !== location.pathname + location.search) history.replaceState(history.state, "", address + location.hash);
}

/** The address with this filter; its other parameters stay. */
export function withFilter(address: string, filter: RouteFilter): string {
  const [path, query] = address.split("?");
  const search = new URLSearchParams(query);
  for (const key of KEYS) {
    if (filter[key] === ALL[key]) search.delete(key);
    else search.set(key, filter[key]);
  }
  return search.size ? `${path}?${search}` : path!;
}
