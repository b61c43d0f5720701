/** Controls on the cards of holds and routes in edit mode, and the editor's own cards. */

import type { Hold, Route, Tables } from "../data/types";
import { say } from "../languages";
import { colourName, holdName, leftOutWords, routeName, typeName } from "../languages/format";
import { h } from "../panels/dom";
import { holdBackground } from "../panels/swatch";
import { NONE, refOf, routeRef } from "./edit_log";
import type { Edit, Role, RouteFacts } from "./edit_log";
import { button, choice, line, oneOf, paragraph } from "./form";
import type { Way } from "./server";

const TYPES = ["jug", "crimp", "sloper", "pinch", "pocket", "foothold"];
const ROLES: Role[] = ["start", "top", "zone", "foot", "hand"];

/** The actions of the cards. */
export interface Acts {
  readonly tables: Tables;
  /** Colours of the wall's holds and routes. */
  readonly colours: string[];
  /** One step in the log. */
  change(...step: Edit[]): void;
  doubted(hold: Hold | Route): boolean;
  cut(): void;
  /** Request changes that make a route one grade easier, or harder. */
  adjustGrade(route: Route, way: Way): void;
  photos(hold: Hold): HTMLElement;
  choose(route: number | null, hold: number | null): void;
}

export function roleOf(hold: Hold, route: Route): Role {
  if (route.start?.includes(hold.id)) return "start";
  if (route.top?.includes(hold.id)) return "top";
  if (route.zone?.includes(hold.id)) return "zone";
  return route.footholds?.includes(hold.id) ? "foot" : "hand";
}

/** Entries that say that a doubtful route's start and top are right. */
function confirmed(route: Route, tables: Tables): Edit[] {
  const to = routeRef(route, tables);
  return (["start", "top"] as const).flatMap((role) =>
    (route[role] ?? []).map((id): Edit => ({ do: "role", hold: refOf(tables.holds.get(id)!), route: to, role })),
  );
}

/** Entries that take a route off the wall; its holds stay on their others. */
function gone(route: Route, tables: Tables): Edit[] {
  const to = { id: route.id };
  return route.holds.map((id): Edit => ({ do: "leave", hold: refOf(tables.holds.get(id)!), route: to }));
}

export function holdControls(hold: Hold, on: Acts): HTMLElement[] {
  const { edit } = say();
  const { tables } = on;
  const route = hold.route === null ? undefined : tables.routes.get(hold.route);
  const routes = [...tables.routes.values()].map((one): [string, string] => [String(one.id), routeName(one)]);
  const colours = on.colours.map((name): [string, string] => [name, colourName(name)]);
  const types = TYPES.map((name): [string, string] => [name, typeName(name)]);
  const classes: [string, string][] = [["hold", edit.oneHold], ["volume", say().words.volume]];
  const self = refOf(hold);
  const parts: HTMLElement[] = [];
  if (route) {
    const roles = ROLES.map((role): [Role, string] => [role, say().words[role]]);
    const to = routeRef(route, tables);
    parts.push(oneOf(edit.role, roles, roleOf(hold, route), (role) => on.change({ do: "role", hold: self, route: to, role })));
  }
  parts.push(
    h(
      "div",
      { class: "fields" },
      choice(edit.route, [["0", edit.none], ...routes], String(hold.route ?? 0), (id) => {
        const to = tables.routes.get(Number(id));
        on.change({ do: "assign", hold: self, route: to ? routeRef(to, tables) : NONE });
      }),
      choice(say().words.colour, colours, hold.colour ?? "", (colour) => on.change({ do: "hold", hold: self, colour })),
      choice(edit.secondColour, [["", edit.none], ...colours], hold.second_colour ?? "", (second_colour) => on.change({ do: "hold", hold: self, second_colour })),
      choice(say().words.type, types, hold.type ?? "", (type) => on.change({ do: "hold", hold: self, type })),
      choice(edit.class, classes, hold.class, (name) => on.change({ do: "hold", hold: self, class: name === "volume" ? name : "hold" })),
    ),
    h(
      "div",
      { class: "fields" },
      button(edit.notAHold, () => on.change({ do: "remove", hold: self })),
      button(edit.cut, () => on.cut()),
      on.doubted(hold) && button(edit.right, () => on.change({ do: "hold", hold: self })),
      on.photos(hold),
    ),
  );
  return parts;
}

export function routeControls(route: Route, on: Acts): HTMLElement[] {
  const { edit } = say();
  const { tables } = on;
  const self = routeRef(route, tables);
  const set = (facts: RouteFacts): void => on.change({ do: "route", route: self, ...facts });
  const others = [...tables.routes.values()].filter(({ id }) => id !== route.id);
  const colours = on.colours.map((name): [string, string] => [name, colourName(name)]);
  const { words } = say();
  const doubts = [[words.start, route.doubtful_start], [words.top, route.doubtful_top]]
    .filter(([, why]) => why)
    .map(([where, why = ""]) => h("p", { class: "doubt" }, `${where}: ${say().doubts[why] ?? why}`));
  const parts: HTMLElement[] = [
    h(
      "div",
      { class: "fields" },
      line(edit.name, route.name ?? "", (name) => set({ name }), { hint: routeName({ ...route, name: "" }) }),
      line(edit.grade, route.grade ?? "", (grade) => set({ grade })),
      line(edit.setter, route.setter ?? "", (setter) => set({ setter })),
      line(edit.date, route.date ?? "", (date) => set({ date }), { type: "date" }),
      choice(say().words.colour, colours, route.colour ?? "", (colour) => set({ colour })),
      choice(edit.merge, [["", edit.choose], ...others.map((one): [string, string] => [String(one.id), routeName(one)])], "", (id) => {
        const other = tables.routes.get(Number(id));
        if (other) on.change({ do: "merge", routes: [self, routeRef(other, tables)] });
      }),
      paragraph(edit.description, route.description ?? "", (description) => set({ description })),
    ),
  ];
  const { proposing } = say();
  parts.push(
    h(
      "div",
      { class: "fields" },
      button(proposing.easier, () => on.adjustGrade(route, "easier")),
      button(proposing.harder, () => on.adjustGrade(route, "harder")),
      route.proposed && button(proposing.climbed, () => set({ proposed: false })),
      route.proposed && button(proposing.takeOff, () => on.change(...gone(route, tables))),
    ),
  );
  if (on.doubted(route)) {
    parts.push(...doubts, button(edit.right, () => on.change(...confirmed(route, tables))));
  }
  return parts;
}

/** Instances that are no holds, to be chosen from. */
export function leftOutList(holds: Hold[], choose: (hold: Hold) => void, close: HTMLElement): HTMLElement[] {
  const { edit } = say();
  const rows = holds.map((hold) =>
    h(
      "button",
      { class: "route", onClick: () => choose(hold) },
      h("span", { class: "swatch", style: `background:${holdBackground(hold, null)}` }),
      h("span", { class: "name" }, holdName(hold)),
      h("span", { class: "meta" }, leftOutWords(hold)),
    ),
  );
  const title = h("div", { class: "title" }, h("h3", {}, edit.leftOut), h("p", { class: "sub" }, edit.leftOutHint));
  return [h("div", { class: "top" }, title, close), h("div", { class: "left-out" }, ...rows)];
}

/** One of them. */
export function leftOutCard(hold: Hold, on: Acts, close: HTMLElement): HTMLElement[] {
  const { edit } = say();
  const title = h("div", { class: "title" }, h("h3", {}, holdName(hold)), h("p", { class: "sub" }, leftOutWords(hold)));
  const swatch = h("span", { class: "swatch", style: `background:${holdBackground(hold, null)}` });
  const back = button(edit.bringBack, () => on.change({ do: "keep", hold: refOf(hold) }));
  back.classList.add("main");
  return [h("div", { class: "top" }, swatch, title, close), h("div", { class: "fields" }, back, on.photos(hold))];
}

/** Holds that were marked together. */
export function severalCard(holds: Hold[], on: Acts & { done(): void; nextRouteId(): number }, close: HTMLElement): HTMLElement[] {
  const { edit } = say();
  const refs = holds.map(refOf);
  const routes = [...on.tables.routes.values()];
  const act = (...step: Edit[]): void => {
    on.done();
    on.change(...step);
  };
  const from = holds.map((hold) => on.tables.routes.get(hold.route ?? -1)).find(Boolean);
  const title = h("div", { class: "title" }, h("h3", {}, edit.marked(holds.length)), h("p", { class: "sub" }, edit.markedHint));
  const parts = [h("div", { class: "top" }, title, close)];
  if (holds.length === 0) return parts;
  const make = button(edit.makeRoute, () => {
    act({ do: "split", route: from ? routeRef(from, on.tables) : NONE, holds: refs, new: on.nextRouteId() });
  });
  make.classList.add("main");
  const targets = routes.map((one): [string, string] => [String(one.id), routeName(one)]);
  parts.push(
    h(
      "div",
      { class: "fields" },
      make,
      holds.length > 1 && button(edit.join, () => act({ do: "join", holds: refs })),
      choice(edit.toRoute, [["", edit.choose], ["0", edit.none], ...targets], "", (id) => {
        if (id === "") return;
        const to = on.tables.routes.get(Number(id));
        act(...refs.map((hold): Edit => ({ do: "assign", hold, route: to ? routeRef(to, on.tables) : NONE })));
      }),
    ),
  );
  return parts;
}
