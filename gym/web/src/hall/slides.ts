/** The slides of the hall screen. */

import type { Schemas } from "../api/client";

export type Facts = Schemas["ScreenOut"];
type Route = Facts["routes"][number];
type Wall = Facts["walls"][number];

export type Slide =
  | { kind: "routes"; key: string; wall: Wall; routes: Route[] }
  | { kind: "wall"; key: string; wall: Wall }
  | { kind: "board"; key: string; lines: NonNullable<Facts["board"]> }
  | { kind: "dates"; key: string; dates: Facts["dates"] };

const MAX = 5; // rows that fit beside or below the wall: sizes go with the screen's

/** In the order of the gym's choice. Never empty if there is a wall to show. */
export function slides(facts: Facts): Slide[] {
  const found: Slide[] = [];
  for (const part of facts.parts) {
    if (part === "routes") found.push(...ofRoutes(facts));
    else if (part === "board") found.push(...pages(facts.board ?? []).map((lines, page): Slide => ({ kind: "board", key: `board ${page}`, lines })));
    else if (part === "dates") found.push(...pages(facts.dates).map((dates, page): Slide => ({ kind: "dates", key: `dates ${page}`, dates })));
  }
  // Walls without new routes are shown too.
  if (facts.parts.includes("wall")) {
    const result = new Set(found.map((slide) => (slide.kind === "routes" ? slide.wall.id : "")));
    found.push(...facts.walls.filter(({ id }) => !result.has(id)).map((wall): Slide => ({ kind: "wall", key: `wall ${wall.id}`, wall })));
  }
  return found;
}

function ofRoutes(facts: Facts): Slide[] {
  return facts.walls.flatMap((wall) =>
    pages(facts.routes.filter(({ wall_id }) => wall_id === wall.id)).map((routes, page): Slide => ({
      kind: "routes", key: `routes ${wall.id} ${page}`, wall, routes,
    })),
  );
}

function pages<T>(rows: T[]): T[][] {
  return Array.from({ length: Math.ceil(rows.length / MAX) }, (_, page) => rows.slice(page * MAX, (page + 1) * MAX));
}
