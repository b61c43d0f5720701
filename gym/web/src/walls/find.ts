/** Filters and orders routes. */

import type { Schemas } from "../api/client";
import { plain } from "../lib/plain";
import { longestReach } from "./reach";

export type Route = Schemas["RouteOut"];
export type Tally = Schemas["TallyOut"];

export const ONLY = ["new", "todo", "projects", "soon", "done"] as const;
export const LEANS = ["slab", "vertical", "overhang", "steep"] as const;
/** Bounds of the number of holds: at most, and the last one without an end. */
export const HOLDS = ["-6", "7-10", "11-15", "16-"] as const;
export const ORDERS = ["wall", "grade", "new", "stars", "climbed"] as const;

export interface RouteFilter {
  text: string;
  colour: string;
  /** Ranks among the gym's grades (`Known.rank`), as a form has them; empty: no bound. */
  low: string;
  high: string;
  setter: string;
  discipline: string;
  lean: "" | (typeof LEANS)[number];
  /** A type of hold, of which at least a third of the route's holds are. */
  type: string;
  holds: "" | (typeof HOLDS)[number];
  /** Metres at most, of the route's height and of the longest reach on it. */
  tall: string;
  far: string;
  /** Only routes whose top climbers of one's own height reach. */
  fits: "" | "yes";
  /** A hold of a version, as `holdKey` writes it. */
  hold: string;
  /** Id of a route: those that climb like it, the most similar first. */
  like: string;
  only: "" | (typeof ONLY)[number];
  order: (typeof ORDERS)[number];
}

export const ALL: RouteFilter = { text: "", colour: "", low: "", high: "", setter: "", discipline: "", lean: "", type: "", holds: "", tall: "", far: "", fits: "", hold: "", like: "", only: "", order: "wall" };

export const holdKey = (scan: string, hold: number): string => `${scan}.${hold}`;

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
  /** In metres. */
  readonly height: number;
  /** Ids of the routes that climb like `RouteFilter.like`; undefined while they are loaded. */
  readonly similar: string[] | undefined;
  /** The published version of a wall. */
  scanOf(wall: string): string | null;
}

// As the viewer has it (`viewer/src/data/steepness.ts`): whole degrees, positive where it overhangs.
const VERTICAL_DEG = 5;
const STEEP_DEG = 35;
// A route has many holds of a type if one of three is.
const MANY = 3;

function isLean(route: Route, lean: RouteFilter["lean"]): boolean {
  if (!lean) return true;
  if (route.steepness_deg == null) return false;
  const degrees = Math.round(route.steepness_deg);
  if (lean === "vertical") return Math.abs(degrees) <= VERTICAL_DEG;
  return lean === "slab" ? degrees < -VERTICAL_DEG : degrees >= (lean === "steep" ? STEEP_DEG : VERTICAL_DEG + 1);
}

function hasHolds(route: Route, filter: RouteFilter, known: Known): boolean {
  const count = route.holds?.length ?? 0;
  if (filter.holds) {
    const [low, high] = filter.holds.split("-");
    if (count === 0 || count < Number(low) || (high && count > Number(high))) return false;
  }
  if (filter.type && (route.hold_types?.[filter.type] ?? 0) * MANY < Math.max(count, 1)) return false;
  const [scan, hold] = filter.hold.split(".");
  return !filter.hold || (known.scanOf(route.wall_id) === scan && Boolean(route.holds?.includes(Number(hold))));
}

/** Whether a route's height and reach are within the bounds. Routes without known moves are outside those of the reach. */
function isInReach(route: Route, filter: RouteFilter, known: Known): boolean {
  if (filter.tall && (route.height_m == null || route.height_m > Number(filter.tall))) return false;
  if (!filter.far && !filter.fits) return true;
  const longest = longestReach(route, known.height);
  return longest !== null && (!filter.far || longest <= Number(filter.far));
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
    if (filter.discipline && !(route.disciplines as string[]).includes(filter.discipline)) return false;
    const rank = known.rank(route);
    if ((filter.low !== "" || filter.high !== "") && (rank < 0 || rank < low || rank > high)) return false;
    if (!isLean(route, filter.lean) || !isOnly(route, filter.only, known)) return false;
    if (!hasHolds(route, filter, known) || !isInReach(route, filter, known)) return false;
    if (filter.like && !known.similar?.includes(route.id)) return false;
    const result = plain([route.name, route.setter, route.grade, known.colourName(route.colour), ...route.tags].join(" "));
    return words.every((word) => result.includes(word));
  });
  return ordered(found, filter, known);
}

function ordered(routes: Route[], { order, like }: RouteFilter, known: Known): Route[] {
  if (order === "wall") {
    const places = new Map((like ? (known.similar ?? []) : []).map((id, place) => [id, place]));
    return places.size ? [...routes].sort((a, b) => places.get(a.id)! - places.get(b.id)!) : routes;
  }
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
