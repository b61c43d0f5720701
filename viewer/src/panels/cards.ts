/** The card of the chosen route or hold. */

import type { Vision } from "../data/colour_vision";
import type { Hold, Route, Tables } from "../data/types";
import type { RouteMoves } from "../data/wire";
import { say } from "../languages";
import {
  capital,
  colourName,
  holdColours,
  holdName,
  lengthText,
  routeFacts,
  routeName,
  routeOrigin,
  steepness,
  typeName,
} from "../languages/format";
import { h, icon } from "./dom";
import { holdBackground, routeBackground } from "./swatch";

export interface CardActions {
  previous(): void;
  next(): void;
  climber(): void;
  /** Shows how it may go; null where nothing is known of that. */
  moves: (() => void) | null;
  close(): void;
  route(id: number): void;
  /** The reader's colour vision. */
  vision: Vision | null;
}

function facts(rows: [string, string][]): HTMLElement {
  return h("dl", {}, ...rows.map(([term, text]) => h("div", {}, h("dt", {}, term), h("dd", {}, text))));
}

function button(label: string, shape: Parameters<typeof icon>[0], act: () => void): HTMLElement {
  return h("button", { class: "tool", "aria-label": label, title: label, onClick: act }, icon(shape));
}

/** Swatch (or picture), name and the line below it. */
function top(colour: string, name: string, text: string, close: HTMLElement, cutout?: string): HTMLElement {
  return h(
    "div",
    { class: "top" },
    cutout ? h("img", { class: "cutout", src: cutout, alt: "" }) : h("span", { class: "swatch", style: `background:${colour}` }),
    h("div", { class: "title" }, h("h3", { tabindex: -1 }, name), h("p", { class: "sub" }, text)),
    close,
  );
}

function actions(act: CardActions): HTMLElement {
  const label = say().words.climber;
  return h(
    "div",
    { class: "actions" },
    button(say().words.previous, "previous", () => act.previous()),
    h("button", { class: "pill main", onClick: () => act.climber() }, icon("climber"), label),
    button(say().words.next, "next", () => act.next()),
  );
}

/** The range of grades, and the way to see how it may go. */
function mayGo(grade: RouteMoves["grade"], act: CardActions): HTMLElement | null {
  if (!act.moves) return null;
  const { words, gradeRange } = say();
  const range = grade ? h("span", { class: "range" }, gradeRange(grade.low, grade.high, grade.graded ?? 0)) : null;
  return h("div", { class: "may" }, h("button", { class: "pill", onClick: () => act.moves!() }, icon("play"), words.mayGo), range);
}

/** `holds`: the list of the route's holds. */
export function routeCard(
  route: Route,
  tables: Tables,
  act: CardActions,
  holds: HTMLElement,
  grade: RouteMoves["grade"] = null,
): HTMLElement[] {
  const close = button(say().words.showAll, "close", () => act.close());
  const text = routeFacts(route, tables.metric);
  const parts = [top(routeBackground(route, tables, act.vision), routeName(route), text, close)];
  const origin = routeOrigin(route);
  if (origin) parts.push(h("p", { class: "note" }, origin));
  if (route.proposed) parts.push(h("p", { class: "note warn" }, say().proposing.proposed));
  if (route.description) parts.push(h("p", { class: "note" }, route.description));
  const may = mayGo(grade, act);
  if (may) parts.push(may);
  return [...parts, actions(act), holds];
}

export function holdCard(hold: Hold, tables: Tables, act: CardActions): HTMLElement[] {
  const route = hold.route === null ? undefined : tables.routes.get(hold.route);
  const { words, holdLine } = say();
  const kind = hold.class === "volume" ? words.volume : capital(typeName(hold.type));
  const where = route
    ? routeName(route)
    : hold.class === "volume"
      ? words.everyRoute
      : hold.role === "downclimb"
        ? words.climbDown
        : words.noRoute;
  const close = button(route ? words.backToRoute : words.close, "close", () => act.close());
  const parts = [
    top(holdBackground(hold, act.vision), holdName(hold), holdLine(hold.id, where), close, hold.cutout),
    facts([
      [words.colour, capital(holdColours(hold) || colourName(null))],
      [words.type, kind],
      [words.size, lengthText(hold.size_m, tables.metric)],
      [words.steepness, capital(steepness(hold.steepness_deg))],
    ]),
  ];
  if (route) parts.push(actions(act));
  return parts;
}
