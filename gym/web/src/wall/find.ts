/** Which routes a climber asked for, and in which order. */

import type { Schemas } from "../api/client";

export type Route = Schemas["RouteFacts"];
export type Tally = Schemas["TallyFacts"];

export const ONLY = ["new", "todo", "projects", "soon", "done"] as const;
export const LEANS = ["slab", "vertical", "overhang", "steep"] as const;
export const ORDERS = ["wall", "grade", "new", "stars", "climbed"] as const;

export interface Wish {
  text: string;
  colour: string;
  /** Places in the gym's grades (`Known.rank`), as a form has them; empty: no bound. */
  low: string;
  high: string;
  setter: string;
  lean: "" | (typeof LEANS)[number];
  only: "" | (typeof ONLY)[number];
  order: (typeof ORDERS)[number];
}

export const ALL: Wish = { text: "", colour: "", low: "", high: "", setter: "", lean: "", only: "", order: "wall" };

/** What is known besides the routes themselves; all of it about one gym. */
export interface Known {
  /** Place of a route's grade among all of the gym's, from the easiest; -1: it has none. */
  rank(route: Route): number;
  label(rank: number): string;
  tally(route: Route): Tally | undefined;
  isNew(route: Route): boolean;
  isSoon(route: Route): boolean;
  isDone(route: Route): boolean;
  isProject(route: Route): boolean;
  colourName(colour: string): string;
}

function plain(text: string): string {
  return text.normalize("NFKD").replace(/\p{M}/gu, "").toLocaleLowerCase();
}

// As the viewer has it (`viewer/src/steepness.ts`): whole degrees, positive where it overhangs.
const VERTICAL_DEG = 5;
const STEEP_DEG = 35;

function isLean(route: Route, lean: Wish["lean"]): boolean {
  if (!lean) return true;
  if (route.steepness_deg == null) return false;
  const degrees = Math.round(route.steepness_deg);
  if (lean === "vertical") return Math.abs(degrees) <= VERTICAL_DEG;
  return lean === "slab" ? degrees < -VERTICAL_DEG : degrees >= (lean === "steep" ? STEEP_DEG : VERTICAL_DEG + 1);
}

function isOnly(route: Route, only: Wish["only"], known: Known): boolean {
  if (only === "new") return known.isNew(route);
  if (only === "soon") return known.isSoon(route);
  if (only === "done") return known.isDone(route);
  if (only === "todo") return !known.isDone(route);
  return only === "" || known.isProject(route);
}

/** Without accents and case; each word may be in another field. */
export function find(routes: Route[], wish: Wish, known: Known): Route[] {
  const words = plain(wish.text).split(/\s+/).filter(Boolean);
  const [low, high] = [wish.low === "" ? -Infinity : Number(wish.low), wish.high === "" ? Infinity : Number(wish.high)];
  const found = routes.filter((route) => {
    if (wish.colour && route.colour !== wish.colour) return false;
    if (wish.setter && route.setter !== wish.setter) return false;
    const rank = known.rank(route);
    if ((wish.low !== "" || wish.high !== "") && (rank < 0 || rank < low || rank > high)) return false;
    if (!isLean(route, wish.lean) || !isOnly(route, wish.only, known)) return false;
    const told = plain([route.name, route.setter, route.grade, known.colourName(route.colour), ...route.tags].join(" "));
    return words.every((word) => told.includes(word));
  });
  return ordered(found, wish.order, known);
}

function ordered(routes: Route[], order: Wish["order"], known: Known): Route[] {
  if (order === "wall") return routes;
  const measure: Record<Exclude<Wish["order"], "wall">, (route: Route) => number> = {
    // What has no grade comes last.
    grade: (route) => (known.rank(route) < 0 ? Infinity : known.rank(route)),
    new: (route) => -Date.parse(route.set_on),
    stars: (route) => -(known.tally(route)?.stars ?? 0),
    climbed: (route) => -(known.tally(route)?.climbers ?? 0),
  };
  const of = new Map(routes.map((route) => [route, measure[order](route)]));
  // Infinity less itself is no number.
  return [...routes].sort((a, b) => (of.get(a) === of.get(b) ? 0 : of.get(a)! < of.get(b)! ? -1 : 1));
}

/** Whether anything is left out; the order leaves out nothing. */
export function isFiltered(wish: Wish): boolean {
  return (Object.keys(ALL) as (keyof Wish)[]).some((key) => key !== "order" && wish[key] !== ALL[key]);
}
