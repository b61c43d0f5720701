/** Filters and orders routes. */

import type { Schemas } from "../api/client";
import { plain } from "../lib/plain";

export type Route = Schemas["RouteOut"];
export type Tally = Schemas["TallyOut"];

export const ONLY = ["new", "todo", "projects", "soon", "done"] as const;
export const LEANS = ["slab", "vertical", "overhang", "steep"] as const;
export const ORDERS = ["wall", "grade", "new", "stars", "climbed"] as const;

export interface RouteFilter {
  text: string;
  colour: string;
  /** Ranks among the gym's grades (`Known.rank`), as a form has them; empty: no bound. */
  low: string;
  high: string;
  setter: string;
  lean: "" | (typeof LEANS)[number];
  only: "" | (typeof ONLY)[number];
  order: (typeof ORDERS)[number];
}

export const ALL: RouteFilter = { text: "", colour: "", low: "", high: "", setter: "", lean: "", only: "", order: "wall" };

/** Facts about a gym besides its routes. */
export interface Known {
  /** Rank of a route's grade among the gym's, from the easiest; -1: no grade. */
  rank(route: Route): number;
  label(rank: number): string;
  tally(route: Route): Tally | undefined;
  isNew(route: Route): boolean;
  isSoon(route: Route): boolean;
  isDone(route: Route): boolean;
  isProject(route: Route): boolean;
  colourName(colour: string): string;
}

// As the viewer has it (`viewer/src/data/steepness.ts`): whole degrees, positive where it overhangs.
const VERTICAL_DEG = 5;
const STEEP_DEG = 35;

function isLean(route: Route, lean: RouteFilter["lean"]): boolean {
  if (!lean) return true;
  if (route.steepness_deg == null) return false;
  const degrees = Math.round(route.steepness_deg);
  if (lean === "vertical") return Math.abs(degrees) <= VERTICAL_DEG;
  return lean === "slab" ? degrees < -VERTICAL_DEG : degrees >= (lean === "steep" ? STEEP_DEG : VERTICAL_DEG + 1);
}

function isOnly(route: Route, only: RouteFilter["only"], known: Known): boolean {
  if (only === "new") return known.isNew(route);
  if (only === "soon") return known.isSoon(route);
  if (only === "done") return known.isDone(route);
  if (only === "todo") return !known.isDone(route);
  return only === "" || known.isProject(route);
}

/** Without accents and case; each word may be in another field. */
export function find(routes: Route[], filter: RouteFilter, known: Known): Route[] {
  const words = plain(filter.text).split(/\s+/).filter(Boolean);
  const [low, high] = [filter.low === "" ? -Infinity : Number(filter.low), filter.high === "" ? Infinity : Number(filter.high)];
  const found = routes.filter((route) => {
    if (filter.colour && route.colour !== filter.colour) return false;
    if (filter.setter && route.setter !== filter.setter) return false;
    const rank = known.rank(route);
    if ((filter.low !== "" || filter.high !== "") && (rank < 0 || rank < low || rank > high)) return false;
    if (!isLean(route, filter.lean) || !isOnly(route, filter.only, known)) return false;
    const result = plain([route.name, route.setter, route.grade, known.colourName(route.colour), ...route.tags].join(" "));
    return words.every((word) => result.includes(word));
  });
  return ordered(found, filter.order, known);
}

function ordered(routes: Route[], order: RouteFilter["order"], known: Known): Route[] {
  if (order === "wall") return routes;
  const measure: Record<Exclude<RouteFilter["order"], "wall">, (route: Route) => number> = {
    // Routes without a grade come last.
    grade: (route) => (known.rank(route) < 0 ? Infinity : known.rank(route)),
    new: (route) => -Date.parse(route.set_on),
    stars: (route) => -(known.tally(route)?.stars ?? 0),
    climbed: (route) => -(known.tally(route)?.climbers ?? 0),
  };
  const of = new Map(routes.map((route) => [route, measure[order](route)]));
  // Infinity less itself is no number.
  return [...routes].sort((a, b) => (of.get(a) === of.get(b) ? 0 : of.get(a)! < of.get(b)! ? -1 : 1));
}

/** Whether a filter is set; the order is not a filter. */
export function isFiltered(filter: RouteFilter): boolean {
  return (Object.keys(ALL) as (keyof RouteFilter)[]).some((key) => key !== "order" && filter[key] !== ALL[key]);
}
