/** The setter's corrections: the two edit files as data, and what they do to the tables. */

import type { Hold, Route, Tables, Vec3 } from "./types";

export interface HoldEdit {
  id: number;
  at: Vec3;
  colour?: string;
  type?: string;
  deleted?: boolean;
}
export interface Stroke {
  hold: number;
  at: Vec3;
  radius_m: number;
}
export interface EditDocument {
  holds: { version: 1; holds: HoldEdit[]; strokes: Stroke[] };
  routes: {
    version: 1;
    merge: { routes: number[]; at: Vec3[] }[];
    split: { route: number; holds: number[]; at: Vec3[] }[];
    assign: { hold: number; at: Vec3; route: number; route_at?: Vec3 }[];
    rename: { route: number; at: Vec3; name: string }[];
    colour: { route: number; at: Vec3; colour: string }[];
  };
}

export function emptyEdits(): EditDocument {
  return {
    holds: { version: 1, holds: [], strokes: [] },
    routes: { version: 1, merge: [], split: [], assign: [], rename: [], colour: [] },
  };
}

/** A route id that no route has yet. */
function fresh(routes: Map<number, Route>): number {
  return Math.max(0, ...routes.keys()) + 1;
}

function editHolds(tables: Tables, edits: HoldEdit[]): Map<number, Hold> {
  const holds = new Map([...tables.holds].map(([id, hold]) => [id, { ...hold }]));
  for (const edit of edits) {
    const hold = holds.get(edit.id);
    if (!hold) continue;
    if (edit.deleted) holds.delete(edit.id);
    if (edit.type !== undefined) hold.type = edit.type;
    if (edit.colour === undefined || edit.colour === hold.colour) continue;
    const like = [...tables.holds.values()].find((other) => other.colour === edit.colour);
    hold.colour = edit.colour;
    hold.colour_rgb = like?.colour_rgb ?? hold.colour_rgb;
  }
  return holds;
}

/** Route of each hold after merge, split and assign, in this order, as the scan does it. */
function editMembers(tables: Tables, edits: EditDocument["routes"]): Map<number, number> {
  const member = new Map<number, number>();
  for (const route of tables.routes.values()) {
    for (const hold of route.holds) member.set(hold, route.id);
  }
  let next = fresh(tables.routes);
  for (const { routes } of edits.merge) {
    for (const [hold, route] of member) if (routes.includes(route)) member.set(hold, routes[0]!);
  }
  for (const { holds } of edits.split) {
    for (const hold of holds) member.set(hold, next);
    next += 1;
  }
  for (const { hold, route } of edits.assign) {
    if (route === 0) member.delete(hold);
    else member.set(hold, route);
  }
  return member;
}

/** What the tables look like with the edits; the given tables stay as they are. */
export function applyEdits(tables: Tables, edits: EditDocument): Tables {
  const holds = editHolds(tables, edits.holds.holds);
  const member = editMembers(tables, edits.routes);
  const routes = new Map<number, Route>();
  for (const hold of holds.values()) {
    const id = member.get(hold.id);
    hold.route = id ?? null;
    if (id === undefined) continue;
    const before = tables.routes.get(id);
    const route = routes.get(id) ?? {
      ...(before ?? { id, length_m: null, steepness_deg: null, colour: hold.colour }),
      holds: [],
    };
    route.holds.push(hold.id);
    routes.set(id, route);
  }
  for (const route of routes.values()) order(route, tables.routes.get(route.id), holds);
  for (const { route, name } of edits.routes.rename) {
    const found = routes.get(route);
    if (found) found.name = name;
  }
  for (const { route, colour } of edits.routes.colour) {
    const found = routes.get(route);
    if (found) found.colour = colour;
  }
  const sorted = new Map([...routes].sort(([a], [b]) => a - b));
  return { ...tables, holds, routes: sorted };
}

/** From bottom to top; start and top stay where they still belong to the route. */
function order(route: Route, before: Route | undefined, holds: Map<number, Hold>): void {
  route.holds.sort((a, b) => holds.get(a)!.position[2] - holds.get(b)!.position[2]);
  const same = before?.holds.length === route.holds.length;
  if (same && before.holds.every((id) => route.holds.includes(id))) {
    route.holds = [...before.holds];
    return;
  }
  route.start = route.holds.slice(0, 1);
  route.top = route.holds.slice(-1);
}
